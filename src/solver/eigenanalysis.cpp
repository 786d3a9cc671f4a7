#include "solver/eigenanalysis.h"

#include <algorithm>
#include <cmath>

#include "solver/eigen_lapack.h"
#include "solver/eigen_spectrum.h"
#include "solver/linearization.h"
#include "solver/stoppable.h"

namespace mbcosim {

namespace {

constexpr int kLargestWhole = 4000;  ///< unknowns; beyond, the matrices alone take gigabytes

/// α, β = 1 and right vectors of the eigenvalues nearest to 1/κ: those with the largest |Λ + 1|.
Result<GeneralizedEigen> iterative(const Model& model, const State& state,
                                   const EigenSettings& settings, double kappa,
                                   const CancelToken* cancel) {
  auto spectrum = spectrum_near(linearize(model, state, Feedback::open), 1 / kappa, settings.nev,
                                std::max(settings.tolerance, 1e-12), settings.ncv, {true, cancel});
  if (!spectrum) return spectrum.error();
  const Eigen::ArrayXcd ks = kappa * spectrum->values.array(), lambda = (1.0 + ks) / (1.0 - ks);
  GeneralizedEigen result;
  result.alpha_r = lambda.real();
  result.alpha_i = lambda.imag();
  result.beta = VecX::Ones(lambda.size());
  result.right = std::move(spectrum->vectors);
  result.last = static_cast<int>(lambda.size()) - 1;
  return result;
}

/// Of a pair only one is above a lower limit: that with the positive imaginary part.
bool within_limits(const EigenSettings& s, std::complex<double> eigenvalue) {
  const double frequency = eigenvalue.imag() / (2 * M_PI);
  return !(s.lower_frequency >= 0 && frequency <= s.lower_frequency) &&
         !(s.upper_frequency >= 0 && std::abs(frequency) > s.upper_frequency);
}

std::vector<EigenReport::NodePose> poses(const Model& model, const State& state) {
  std::vector<EigenReport::NodePose> nodes;
  const EvalContext context =
      model.context(state, state.step == 0 ? Phase::derivatives : Phase::step);
  for (std::size_t k = 0; k < model.structural.size(); ++k) {
    const StructuralNode& node = model.structural[k];
    if (node.is_dummy()) continue;
    const NodeState s = model.node_state(context, static_cast<int>(k));
    nodes.push_back({node.label, node.first, s.x, vector_of_rotation(s.R)});
  }
  return nodes;
}

}  // namespace

Result<EigenReport> analyse_modes(const Model& model, const State& state,
                                  const EigenSettings& settings, const CancelToken* cancel) {
  EigenReport report;
  report.settings = settings;
  report.time = state.time;
  report.step = state.step;
  report.pencil = bilinear_pencil(model, state, settings.parameter / 2);
  if (settings.geometry) report.nodes = poses(model, state);
  if (!settings.finds_modes()) return report;
  const bool lapack = settings.is_dense();
  if (lapack && model.unknowns > kLargestWhole)
    return make_error(ErrorKind::limit, "EIGENANALYSIS_SIZE",
                      "eigenanalysis: " + std::to_string(model.unknowns) +
                          " unknowns are too many for a dense solver (at most " +
                          std::to_string(kLargestWhole) +
                          "); use `use arpack, <number>, <basis>, <tolerance>`");
  auto solution =
      lapack ? generalized_eigen(model.dense(report.pencil.minus), model.dense(report.pencil.plus),
                                 settings.balance, settings.eigenvectors)
             : iterative(model, state, settings, report.pencil.kappa, cancel);
  if (!solution) return solution.error();
  report.solution = std::move(*solution);
  for (int k = report.solution.first; k <= report.solution.last; ++k)
    if (const auto s = report.eigenvalue(k); std::isfinite(s.real()) && within_limits(settings, s))
      report.modes.push_back(k);
  return report;
}

}  // namespace mbcosim
