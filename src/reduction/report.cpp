#include <cstdarg>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "reduction/reduce.h"

namespace mbcosim {

namespace {

using Json = nlohmann::ordered_json;

std::string line(const char* format, ...) __attribute__((format(printf, 1, 2)));
std::string line(const char* format, ...) {
  char text[256];
  va_list arguments;
  va_start(arguments, format);
  std::vsnprintf(text, sizeof text, format, arguments);
  va_end(arguments);
  return std::string(text) + "\n";
}

Json to_json(const VecX& v) { return std::vector<double>(v.begin(), v.end()); }

}  // namespace

std::string report_text(const Reduction& reduction) {
  const ReductionReport& r = reduction.report;
  std::string text = line("%d unknowns, %d rigid motions, %.3g entries in the factor", r.unknowns,
                          r.rigid_motions, static_cast<double>(r.factor_nonzeros));
  text += line("%d normal modes and %d static shapes, %d removed: %zu shapes", r.normal_modes,
               r.static_shapes, r.removed_shapes, r.frequencies.size());
  text += line("mass %.6g kg, centre of mass at %.6g, %.6g, %.6g m of the floating frame",
               r.inertia.mass, r.inertia.center(0), r.inertia.center(1), r.inertia.center(2));
  if (r.static_error >= 0)
    text += line("largest static error at the interface: %.3g%s%s", r.static_error,
                 r.static_error_at.empty() ? "" : ", ", r.static_error_at.c_str());
  if (r.normal_modes > 0)
    text += line("largest relative residual of a normal mode: %.3g", r.eigen_residual);
  text += "\n shape  frequency [Hz]   effective mass [kg] x, y, z and inertia [kg m^2] x, y, z\n";
  for (std::size_t j = 0; j < r.frequencies.size(); ++j) {
    const VecX e = r.effective_masses.col(static_cast<int>(j));
    text += line("%6zu  %14.6g   %10.4g %10.4g %10.4g %10.4g %10.4g %10.4g", j + 1,
                 r.frequencies[j], e(0), e(1), e(2), e(3), e(4), e(5));
  }
  for (const std::string& warning : r.warnings) text += "warning: " + warning + "\n";
  return text;
}

std::string report_json(const Reduction& reduction) {
  const ReductionReport& r = reduction.report;
  Json inertia = Json::array(), effective = Json::array();
  for (int a = 0; a < 3; ++a) inertia.push_back(to_json(r.inertia.inertia.row(a).transpose()));
  for (int j = 0; j < r.effective_masses.cols(); ++j)
    effective.push_back(to_json(r.effective_masses.col(j)));
  const Json json = {{"unknowns", r.unknowns},
                     {"rigid_motions", r.rigid_motions},
                     {"normal_modes", r.normal_modes},
                     {"static_shapes", r.static_shapes},
                     {"removed_shapes", r.removed_shapes},
                     {"frequencies_hz", r.frequencies},
                     {"normal_frequencies_hz", r.normal_frequencies},
                     {"effective_masses", effective},
                     {"mass_kg", r.inertia.mass},
                     {"center_of_mass_m", to_json(r.inertia.center)},
                     {"inertia_kgm2", inertia},
                     {"static_error", r.static_error < 0 ? Json() : Json(r.static_error)},
                     {"static_error_at", r.static_error_at},
                     {"eigen_residual", r.eigen_residual},
                     {"lumping_change", r.lumping_change},
                     {"factor_nonzeros", r.factor_nonzeros},
                     {"warnings", r.warnings}};
  return json.dump(1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace mbcosim
