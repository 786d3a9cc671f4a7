/// Shift-invert Lanczos in the inner product of M, about zero, with the rigid motions projected
/// out.
#include <optional>
#include <random>

#include "reduction/block_lanczos.h"
#include "reduction/structure.h"

namespace mbcosim {

namespace {

constexpr double kInverted =
    1e-2;                   ///< tolerance of the inverted eigenvalues over that of the modes
constexpr int kAtOnce = 8;  ///< vectors

/// y = Pᵀ K⁻ P x, or with a shift σ y = Pᵀ (K − σ M)⁻¹ P x: the elastic flexibility.
class Flexibility {
 public:
  Flexibility(Structure& structure, double shift, const ReductionProgress& progress, int expected)
      : structure_(structure), progress_(progress), expected_(expected) {
    if (shift < 0)
      shifted_ = SparseFactor::positive(
          structure.shifted(shift), structure.places(),
          [&](int k) { return structure.row_text(k); }, structure.factor_settings());
  }
  MatX operator()(const MatX& forces) {
    const MatX load = structure_.balanced(forces);
    MatX shapes =
        structure_.without_rigid(shifted_ ? shifted_->solve(load) : structure_.solve(load));
    done_ += static_cast<int>(forces.cols());
    look();
    return shapes;
  }
  /// Tells how far it has come, and ends when it is asked to.
  void look() const {
    if (progress_ && !progress_("normal modes", std::min(0.99, double(done_) / expected_)))
      stop_reduction();
  }

 private:
  Structure& structure_;
  const ReductionProgress& progress_;
  int expected_;
  std::optional<SparseFactor> shifted_;
  int done_ = 0;  ///< vectors
};

/// Start vectors within the range of the operator, so that massless rows do no harm.
MatX start_vectors(const Structure& structure, Flexibility& flexibility, int count) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> value(-0.5, 0.5);
  MatX x(structure.size(), count);
  for (double& v : x.reshaped()) v = value(random);
  return flexibility(structure.mass_times(x));
}

}  // namespace

NormalModes Structure::lanczos_modes(int count, const EigenOptions& options,
                                     const ReductionProgress& progress) {
  if (count > size() / 4)
    refuse_reduction(std::to_string(count) + " normal modes of a model with " +
                         std::to_string(size()) + " unknowns are too many",
                     "at most a quarter");
  Flexibility flexibility(*this, options.shift, progress, 6 * (count + kAtOnce));
  const BlockLanczosProblem problem{[&](const MatX& f) { return flexibility(f); },
                                    [&](const MatX& x) {
                                      flexibility.look();
                                      return mass_times(x);
                                    },
                                    count, kInverted * options.tolerance};
  const BlockLanczosResult found =
      block_lanczos(problem, start_vectors(*this, flexibility, kAtOnce),
                    TallProducts(*settings_.kernels, team_.get()));
  if (found.values.size() < count)
    throw ReductionError(ErrorKind::not_converged,
                         "only " + std::to_string(found.values.size()) + " of " +
                             std::to_string(count) +
                             " normal modes converged (does the model have that many?)");
  return {options.shift + found.values.array().inverse(), found.vectors, 0, 0};
}

}  // namespace mbcosim
