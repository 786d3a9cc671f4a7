/// The part of a finite element model that is left when some rows are held: its rigid motions,
/// static solutions and normal modes.
///
///   K x = f                       static solution, factored once: sparse LDLᵀ
///   K φ = ω² M φ                  normal modes, Mᵀ-normalised, ω > 0
///   X_R                           motions without elastic energy, X_Rᵀ M X_R = 1
///   P f = f − M X_R X_Rᵀ f        loads balanced by inertia (inertia relief)
///   Pᵀ x = x − X_R X_Rᵀ M x       motions free of rigid content (mean axes)
///
/// A body that can move freely has a singular K. Static solutions of balanced loads then hold a
/// statically determinate set of rows; the choice adds rigid motion only, which Pᵀ removes.
#pragma once

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include "reduction/error.h"
#include "reduction/fe_model.h"
#include "reduction/sparse_factor.h"

namespace mbcosim {

/// Frequency [Hz] of ω² [1/s²]; 0 of what rounding has made negative.
inline double hertz(double square) {
  return std::sqrt(std::max(0.0, square)) / (2 * std::numbers::pi);
}

/// Normal modes: rows of the structure.
struct NormalModes {
  VecX squares;         ///< ω² [1/s²], ascending
  MatX shapes;          ///< (rows × modes)
  double residual = 0;  ///< largest |K φ − ω² M φ| / |K φ|
  double rounding = 0;  ///< of it what the arithmetic cannot avoid: largest ε ‖ |K| |φ| ‖ / |K φ|
};

/// How normal modes of large structures are found.
struct EigenOptions {
  double tolerance = 1e-10;  ///< relative
  double shift = 0;  ///< σ <= 0 [1/s²]: K − σ M is factored, or with 0 the K of a determinate set
};

class Structure {
 public:
  /// `held`: flags of the model's rows. The model must outlive the structure.
  Structure(const FeModel& model, const std::vector<char>& held,
            const FactorSettings& settings = {});

  int size() const { return static_cast<int>(rows_.size()); }
  const std::vector<int>& rows() const { return rows_; }              ///< of the model
  int position(int model_row) const { return position_[model_row]; }  ///< −1: held
  std::string row_text(int k) const { return model_.dof_text(rows_[k]); }
  SparseMatrix stiffness() const { return part(model_.stiffness); }
  SparseMatrix mass() const { return part(model_.mass); }
  /// K − σ M, with σ in 1/s².
  SparseMatrix shifted(double sigma) const;
  MatX stiffness_times(const MatX& shapes) const { return times(model_.stiffness, shapes); }
  MatX mass_times(const MatX& shapes) const { return times(model_.mass, shapes); }
  const RowPlaces& places() const { return places_; }
  const FactorSettings& factor_settings() const { return settings_; }
  int rigid_count() const { return static_cast<int>(rigid_.cols()); }
  const MatX& rigid() const { return rigid_; }  ///< X_R
  /// Largest strain of the softest combination that is not rigid, relative; small: nearly free.
  double softest() const { return softest_; }

  MatX balanced(MatX loads) const { return loads - mass_rigid_ * (rigid_.transpose() * loads); }
  MatX without_rigid(MatX shapes) const {
    return shapes - rigid_ * (mass_rigid_.transpose() * shapes);
  }
  /// K x = f, column by column; for a free body f must be balanced, and rows of a determinate set
  /// stay at zero.
  MatX solve(const MatX& f);
  /// The lowest elastic modes.
  NormalModes modes(int count, const EigenOptions& options, const ReductionProgress& progress);
  /// Number of elastic modes with ω² below `square`.
  int count_modes_below(double square);
  /// Leaves the memory of the factor to the next count; it is made anew when it is needed.
  void release_factor() {
    if (factor_) released_ = factor_->release();
    factor_.reset();
  }
  long factor_nonzeros() const { return factor_ ? factor_->nonzeros() : 0; }

  /// Shapes of this structure as shapes of the model: held rows are zero.
  MatX embedded(const MatX& shapes) const;
  MatX restricted(const MatX& model_shapes) const;

 private:
  SparseMatrix part(const SparseMatrix& matrix) const;
  MatX times(const SparseMatrix& matrix, const MatX& shapes) const;
  using MultiplyRow = void(const SparseMatrix& matrix, int row, const std::vector<int>& position,
                           const double* x, double* sum);
  void multiply(const SparseMatrix& matrix, const Eigen::Ref<const MatX>& shapes, MultiplyRow* row,
                Eigen::Ref<MatX> result) const;
  SparseFactor::Pattern pattern_for(const SparseMatrix& matrix) const;
  void find_rigid_motions();
  void hold_determinate_set();
  void factor();
  NormalModes dense_modes(int count) const;
  NormalModes lanczos_modes(int count, const EigenOptions& options,
                            const ReductionProgress& progress);
  void finish(NormalModes& modes) const;

  const FeModel& model_;
  std::unique_ptr<ThreadTeam> team_;  ///< null for one thread
  std::vector<int> rows_, position_;
  RowPlaces places_;
  MatX rigid_, mass_rigid_;
  double softest_ = 1;
  std::vector<int> kept_;  ///< rows outside the determinate set
  FactorSettings settings_;
  std::unique_ptr<SparseFactor> factor_;
  FactorMemory released_;
  SparseFactor::Pattern pattern_;     ///< of the last factor
  Eigen::Index pattern_entries_ = 0;  ///< of the matrix that it belongs to
};

/// The rows (ascending) and columns of `matrix` that are listed.
SparseMatrix submatrix(const SparseMatrix& matrix, const std::vector<int>& rows,
                       const std::vector<int>& columns);

}  // namespace mbcosim
