#include <Eigen/Dense>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "cli/commands.h"
#include "cli/fem_file.h"
#include "elements/modal/modal_body.h"
#include "input/sources.h"
#include "math/decompositions.h"
#include "reduction/error.h"

namespace mbcosim::cli {
namespace {

using Json = nlohmann::ordered_json;

/// What is worth telling about a FEM data file.
struct FemSummary {
  FemData data;
  std::vector<double> frequencies;  ///< of the modal matrices [Hz]; infinite for massless shapes
  std::shared_ptr<const ModalBody> body;
  std::vector<std::string> warnings;
};

/// ω² of (K, M) by 1/ω² of (M, K), so that massless shapes do no harm. Empty when K is not
/// positive.
std::vector<double> frequencies_of(const MatX& stiffness, const MatX& mass) {
  const Eigen::GeneralizedSelfAdjointEigenSolver<MatX> solver(mass, stiffness,
                                                              Eigen::EigenvaluesOnly);
  std::vector<double> found;
  if (solver.info() != Eigen::Success) return found;
  for (auto k = mass.rows() - 1; k >= 0; --k) {
    const double mu = solver.eigenvalues()(k);
    found.push_back(mu > 0 ? 1 / (2 * std::numbers::pi * std::sqrt(mu)) : INFINITY);
  }
  return found;
}

FemSummary summarize(const std::string& file, const std::string& bytes) {
  FemSummary s;
  s.data = parse_fem_data(file, bytes);
  s.frequencies = frequencies_of(s.data.stiffness, s.data.mass);
  ModalSelection all;
  for (int j = 1; j <= s.data.mode_count(); ++j) all.modes.push_back(j);
  s.body = make_modal_body(s.data, all, s.warnings);
  for (const Diagnostic& note : s.data.notes) s.warnings.push_back(note.message);
  if (s.frequencies.empty())
    s.warnings.push_back("the modal stiffness matrix is not positive definite");
  return s;
}

Json to_json(const FemSummary& s) {
  const FemData& d = s.data;
  const auto inertia = [&] {
    Json rows = Json::array();
    for (int a = 0; a < 3; ++a)
      rows.push_back({s.body->J0(a, 0), s.body->J0(a, 1), s.body->J0(a, 2)});
    return rows;
  };
  Json frequencies = Json::array();
  for (const double f : s.frequencies) frequencies.push_back(std::isinf(f) ? Json() : Json(f));
  return {{"revision", d.revision},
          {"binary", d.binary},
          {"groups", d.groups},
          {"nodes", d.labels},
          {"modes", d.mode_count()},
          {"rejected_modes", d.rejected},
          {"frequencies_hz", frequencies},
          {"lumped_inertia", d.lumped.has_value()},
          {"rigid_inertia", d.rigid.has_value()},
          {"damping", d.damping.has_value()},
          {"mass_kg", s.body->m},
          {"first_moment_kgm", {s.body->S0(0), s.body->S0(1), s.body->S0(2)}},
          {"inertia_about_origin_kgm2", inertia()},
          {"warnings", s.warnings}};
}

void print(const FemSummary& s) {
  const FemData& d = s.data;
  std::printf("%s form, %d nodes, %d modes", d.binary ? "binary" : "text", d.node_count(),
              d.mode_count());
  if (d.rejected > 0) std::printf(" (%d rejected)", d.rejected);
  std::printf("\nrecord groups:");
  for (const int group : d.groups) std::printf(" %d", group);
  const ModalBody& b = *s.body;
  if (b.m > 0) {
    const Vec3 c = b.S0 / b.m;
    std::printf("\nmass %.6g kg, centre of mass at %.6g, %.6g, %.6g m\n", b.m, c(0), c(1), c(2));
    std::printf("inertia about the origin [kg m^2]:\n");
    for (int a = 0; a < 3; ++a)
      std::printf("  %14.6g %14.6g %14.6g\n", b.J0(a, 0), b.J0(a, 1), b.J0(a, 2));
  } else {
    std::printf("\nno inertia of the body\n");
  }
  std::printf("\n  mode  frequency [Hz]  modal mass     modal stiffness\n");
  for (int j = 0; j < d.mode_count(); ++j)
    std::printf("%6d  %14.6g  %-13.6g  %-13.6g\n", j + 1,
                j < static_cast<int>(s.frequencies.size()) ? s.frequencies[j] : NAN, d.mass(j, j),
                d.stiffness(j, j));
  for (const std::string& warning : s.warnings) std::printf("warning: %s\n", warning.c_str());
}

}  // namespace

int fem_info(const std::string& file, bool json, const std::string& convert) {
  const auto bytes = FolderSource(".", true).read(file);
  if (!bytes) {
    std::fprintf(stderr, "error: %s\n", bytes.error().message.c_str());
    return kDeckRefused;
  }
  try {
    const FemSummary summary = summarize(file, *bytes);
    if (!convert.empty()) write_fem_file(convert, summary.data, {"copy of " + file});
    if (json) {
      std::printf("%s\n",
                  to_json(summary).dump(1, ' ', false, Json::error_handler_t::replace).c_str());
    } else {
      print(summary);
    }
    return kDone;
  } catch (const DeckError& error) {
    std::fprintf(stderr, "%s\n", error.diagnostic.text().c_str());
  } catch (const ReductionError& error) {
    std::fprintf(stderr, "error: %s\n", error.what());
  }
  return kDeckRefused;
}

}  // namespace mbcosim::cli
