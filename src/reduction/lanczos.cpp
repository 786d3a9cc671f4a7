/// Shift-invert Lanczos in the inner product of M, about zero, with the rigid motions projected
/// out.
#include <Spectra/SymGEigsShiftSolver.h>

#include <optional>
#include <random>

#include "reduction/structure.h"

namespace mbcosim {

namespace {

constexpr double kInverted =
    1e-2;  ///< tolerance of the inverted eigenvalues over that of the modes
constexpr int kRestarts = 300;

/// y = Pᵀ K⁻ P x, or with a shift σ y = Pᵀ (K − σ M)⁻¹ P x: the elastic flexibility.
class Flexibility {
 public:
  using Scalar = double;
  Flexibility(Structure& structure, double shift, const ReductionProgress& progress, int expected)
      : structure_(structure), progress_(progress), expected_(expected) {
    if (shift < 0)
      shifted_ = SparseFactor::positive(
          structure.shifted(shift), structure.places(),
          [&](int k) { return structure.row_text(k); }, structure.factor_settings());
  }
  Eigen::Index rows() const { return structure_.size(); }
  Eigen::Index cols() const { return structure_.size(); }
  void set_shift(double) {}
  void perform_op(const double* in, double* out) const {
    const VecX load = structure_.balanced(Eigen::Map<const VecX>(in, rows()));
    Eigen::Map<VecX>(out, rows()) =
        structure_.without_rigid(shifted_ ? shifted_->solve(load) : structure_.solve(load));
    ++*done_;
    if (progress_ && !progress_("normal modes", std::min(0.99, double(*done_) / expected_)))
      stop_reduction();
  }

 private:
  Structure& structure_;
  const ReductionProgress& progress_;
  int expected_;
  std::optional<SparseFactor> shifted_;
  std::unique_ptr<int> done_ = std::make_unique<int>(0);
};

class MassProduct {
 public:
  using Scalar = double;
  explicit MassProduct(const Structure& structure) : structure_(structure) {}
  Eigen::Index rows() const { return structure_.size(); }
  Eigen::Index cols() const { return structure_.size(); }
  void perform_op(const double* in, double* out) const {
    Eigen::Map<VecX>(out, rows()) = structure_.mass_times(Eigen::Map<const VecX>(in, rows()));
  }

 private:
  const Structure& structure_;
};

/// A start vector within the range of the operator, so that massless rows do no harm.
VecX start_vector(const Structure& structure, const Flexibility& flexibility, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> value(-0.5, 0.5);
  VecX x(structure.size()), y(structure.size());
  for (double& v : x) v = value(random);
  x = structure.mass_times(x);
  flexibility.perform_op(x.data(), y.data());
  return y;
}

}  // namespace

NormalModes Structure::lanczos_modes(int count, const EigenOptions& options,
                                     const ReductionProgress& progress) {
  if (count > size() / 4)
    refuse_reduction(std::to_string(count) + " normal modes of a model with " +
                         std::to_string(size()) + " unknowns are too many",
                     "at most a quarter");
  const int basis = std::min(size(), std::max(2 * count + 1, 20));
  Flexibility flexibility(*this, options.shift, progress, 3 * basis);
  MassProduct product(*this);
  Spectra::SymGEigsShiftSolver<Flexibility, MassProduct, Spectra::GEigsMode::ShiftInvert> solver(
      flexibility, product, count, basis, options.shift);
  const VecX start = start_vector(*this, flexibility, 1u);
  solver.init(start.data());
  const auto converged =
      solver.compute(Spectra::SortRule::LargestMagn, kRestarts, kInverted * options.tolerance,
                     Spectra::SortRule::SmallestAlge);
  if (solver.info() != Spectra::CompInfo::Successful)
    throw ReductionError(ErrorKind::not_converged,
                         "only " + std::to_string(converged) + " of " + std::to_string(count) +
                             " normal modes converged (does the model have that many?)");
  return {solver.eigenvalues(), solver.eigenvectors(), 0, 0};
}

}  // namespace mbcosim
