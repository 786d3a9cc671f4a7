#include "reduction/structure.h"

#include <Eigen/Dense>
#include <cmath>
#include <limits>

#include "math/decompositions.h"

namespace mbcosim {

namespace {

constexpr double kNoEnergy = 1e-8;  ///< relative strain of a rigid motion
constexpr int kDenseOrder = 400;    ///< up to here dense eigensolutions

/// √ of the diagonal of K, which makes the strains of different rows comparable.
VecX row_scales(const VecX& stiffness) {
  const VecX diagonal = stiffness.cwiseMax(0);
  const double mean = std::max(diagonal.mean(), 1e-300);
  return diagonal.unaryExpr([mean](double d) { return std::sqrt(d > 1e-14 * mean ? d : mean); });
}

}  // namespace

SparseMatrix submatrix(const SparseMatrix& matrix, const std::vector<int>& rows,
                       const std::vector<int>& columns) {
  std::vector<int> place(matrix.rows(), -1);
  for (std::size_t k = 0; k < rows.size(); ++k) place[rows[k]] = static_cast<int>(k);
  SparseMatrix part(rows.size(), columns.size());
  Eigen::Index count = 0;
  for (const int column : columns)
    for (SparseMatrix::InnerIterator it(matrix, column); it; ++it) count += place[it.row()] >= 0;
  part.reserve(count);
  for (std::size_t c = 0; c < columns.size(); ++c) {
    part.startVec(c);
    for (SparseMatrix::InnerIterator it(matrix, columns[c]); it; ++it)
      if (place[it.row()] >= 0) part.insertBack(place[it.row()], c) = it.value();
  }
  part.finalize();
  return part;
}

Structure::Structure(const FeModel& model, const std::vector<char>& held,
                     const FactorSettings& settings)
    : model_(model), position_(model.rows(), -1), settings_(settings) {
  for (int r = 0; r < model.rows(); ++r) {
    if (held[r]) continue;
    position_[r] = size();
    rows_.push_back(r);
  }
  if (rows_.empty()) refuse_reduction("every degree of freedom is held");
  if (settings.threads > 1) team_ = std::make_unique<ThreadTeam>(settings.threads);
  places_.resize(3, size());
  for (int k = 0; k < size(); ++k) places_.col(k) = model.positions.col(model.dofs[rows_[k]].node);
  find_rigid_motions();
  hold_determinate_set();
}

/// Combinations of the six geometric motions without strain, orthonormal in M.
void Structure::find_rigid_motions() {
  const VecX scale = row_scales(restricted(VecX(model_.stiffness.diagonal())));
  const MatX geometric = restricted(model_.rigid_shapes(model_.positions.rowwise().mean()));
  Eigen::ColPivHouseholderQR<MatX> qr((scale.asDiagonal() * geometric).eval());
  qr.setThreshold(1e-10);
  const int independent = static_cast<int>(qr.rank());
  const MatX motions = scale.cwiseInverse().asDiagonal() *
                       MatX(qr.householderQ() * MatX::Identity(size(), independent));
  const MatX strains = scale.cwiseInverse().asDiagonal() * stiffness_times(motions);
  if (independent == 0 || !strains.allFinite())
    refuse_reduction("the numbers of the stiffness matrix and of the positions overflow");
  const Eigen::JacobiSVD<MatX> svd(strains, Eigen::ComputeThinV);
  int count = 0;
  softest_ = 1;
  for (int k = 0; k < independent; ++k) {
    if (svd.singularValues()(k) <= kNoEnergy)
      ++count;
    else
      softest_ = std::min(softest_, svd.singularValues()(k));
  }
  rigid_ = motions * svd.matrixV().rightCols(count);
  const MatX inertia = rigid_.transpose() * mass_times(rigid_);
  const Eigen::LLT<MatX> root(inertia);
  if (count > 0 &&
      (root.info() != Eigen::Success ||
       Eigen::SelfAdjointEigenSolver<MatX>(inertia).eigenvalues()(0) <= 1e-12 * inertia.trace()))
    refuse_reduction("a rigid motion of the body has no inertia");
  if (count > 0) rigid_ = root.matrixU().solve<Eigen::OnTheRight>(rigid_);
  mass_rigid_ = mass_times(rigid_);
}

void Structure::hold_determinate_set() {
  std::vector<char> held(size(), 0);
  if (rigid_count() > 0) {
    const Eigen::ColPivHouseholderQR<MatX> qr(MatX(rigid_.transpose()));
    for (int k = 0; k < rigid_count(); ++k) held[qr.colsPermutation().indices()(k)] = 1;
  }
  for (int k = 0; k < size(); ++k)
    if (!held[k]) kept_.push_back(k);
}

void Structure::factor() {
  if (factor_) return;
  std::vector<int> rows;  // of the model
  for (const int k : kept_) rows.push_back(rows_[k]);
  const SparseMatrix matrix = submatrix(model_.stiffness, rows, rows);
  factor_ = std::make_unique<SparseFactor>(SparseFactor::positive(
      matrix, places_(Eigen::all, kept_), [&](int k) { return model_.dof_text(rows[k]); },
      settings_));
  if (rigid_count() > 0) return;
  pattern_ = factor_->pattern();
  pattern_entries_ = matrix.nonZeros();
}

MatX Structure::solve(const MatX& f) {
  factor();
  MatX x = MatX::Zero(size(), f.cols());
  x(kept_, Eigen::all) = factor_->solve(f(kept_, Eigen::all));
  return x;
}

NormalModes Structure::modes(int count, const EigenOptions& options,
                             const ReductionProgress& progress) {
  if (count == 0) return {VecX(), MatX(size(), 0), 0, 0};
  factor();  // refuses mechanisms by name
  NormalModes found =
      size() <= kDenseOrder ? dense_modes(count) : lanczos_modes(count, options, progress);
  finish(found);
  return found;
}

/// M φ = μ (K + a M X_R X_Rᵀ M) φ with μ = 1/ω²; massless combinations have μ = 0.
NormalModes Structure::dense_modes(int count) const {
  const MatX mass = this->mass(), elastic = this->stiffness();
  const double a = elastic.trace() / std::max(mass.trace(), 1e-300);
  const MatX stiffness = elastic + a * mass_rigid_ * mass_rigid_.transpose();
  const Eigen::GeneralizedSelfAdjointEigenSolver<MatX> solver(mass, stiffness);
  if (solver.info() != Eigen::Success)
    throw ReductionError(ErrorKind::not_converged, "the dense eigensolution failed");
  NormalModes modes{VecX(count), MatX(size(), count), 0, 0};
  const double largest = solver.eigenvalues()(size() - 1);
  int n = 0;
  for (int k = size() - 1; k >= 0 && n < count; --k) {
    const VecX shape = solver.eigenvectors().col(k);
    const double norm = std::sqrt(std::max(shape.dot(mass_times(shape).col(0)), 1e-300));
    const bool is_rigid = (mass_rigid_.transpose() * shape).norm() > 0.5 * norm;
    if (is_rigid) continue;
    if (solver.eigenvalues()(k) <= 1e-13 * largest) break;
    modes.squares(n) = 1 / solver.eigenvalues()(k);
    modes.shapes.col(n++) = shape / norm;
  }
  if (n < count)
    refuse_reduction(std::to_string(count) + " normal modes asked for, the model has " +
                     std::to_string(n));
  return modes;
}

/// Largest component positive; residual of the eigenproblem.
void Structure::finish(NormalModes& modes) const {
  for (int j = 0; j < modes.shapes.cols(); ++j) {
    auto shape = modes.shapes.col(j);
    shape /= std::sqrt(shape.dot(mass_times(shape).col(0)));
    int largest = 0;
    shape.cwiseAbs().maxCoeff(&largest);
    if (shape(largest) < 0) shape = -shape;
    const VecX force = stiffness_times(shape);
    const double error = (force - modes.squares(j) * mass_times(shape)).norm() / force.norm();
    modes.residual = std::max(modes.residual, error);
    const VecX whole = embedded(shape).cwiseAbs();
    VecX largest_force = VecX::Zero(whole.size());
    for (int c = 0; c < model_.stiffness.outerSize(); ++c)
      for (SparseMatrix::InnerIterator it(model_.stiffness, c); it; ++it)
        largest_force(it.row()) += std::abs(it.value()) * whole(c);
    modes.rounding = std::max(modes.rounding, std::numeric_limits<double>::epsilon() *
                                                  restricted(largest_force).norm() / force.norm());
  }
}

SparseMatrix Structure::part(const SparseMatrix& matrix) const {
  return submatrix(matrix, rows_, rows_);
}

SparseMatrix Structure::shifted(double sigma) const {
  SparseMatrix matrix = stiffness();
  for (int c = 0; c < size(); ++c) {
    SparseMatrix::InnerIterator place(matrix, c);
    for (SparseMatrix::InnerIterator it(model_.mass, rows_[c]); it; ++it) {
      const int row = position_[it.row()];
      if (row < 0) continue;
      while (place && place.row() < row) ++place;
      if (!place || place.row() != row)  // the mass has entries of its own
        return part(model_.stiffness - sigma * model_.mass);
      place.valueRef() -= sigma * it.value();
    }
  }
  return matrix;
}

/// The pattern of the last factor if it serves `matrix`, too: K − σ M has no more entries than K.
SparseFactor::Pattern Structure::pattern_for(const SparseMatrix& matrix) const {
  return matrix.nonZeros() == pattern_entries_ ? pattern_ : nullptr;
}

int Structure::count_modes_below(double square) {
  const SparseMatrix matrix = shifted(square);
  const int below = SparseFactor::count_negative(matrix, places_, settings_, pattern_for(matrix),
                                                 std::exchange(released_, {}));
  return below < 0 ? below : below - rigid_count();
}

namespace {

/// sum = (row k of A) x; the columns of the symmetric matrix are its rows.
template <int kColumns>
void multiply_row(const SparseMatrix& matrix, int row, const std::vector<int>& position,
                  const double* x, double* sum) {
  using Row = Eigen::Matrix<double, 1, kColumns>;
  Row total = Row::Zero();
  for (SparseMatrix::InnerIterator it(matrix, row); it; ++it)
    if (const int at = position[it.row()]; at >= 0)
      total += it.value() * Eigen::Map<const Row>(x + std::ptrdiff_t{at} * kColumns);
  Eigen::Map<Row>{sum} = total;
}

}  // namespace

MatX Structure::times(const SparseMatrix& matrix, const MatX& shapes) const {
  MatX result(size(), shapes.cols());
  for (Eigen::Index c = 0; c < shapes.cols();) {
    constexpr int kWide = 8;
    const bool wide = shapes.cols() - c >= kWide;
    const int columns = wide ? kWide : 1;
    multiply(matrix, shapes.middleCols(c, columns), wide ? multiply_row<kWide> : multiply_row<1>,
             result.middleCols(c, columns));
    c += columns;
  }
  return result;
}

/// Some columns, one row after the other.
void Structure::multiply(const SparseMatrix& matrix, const Eigen::Ref<const MatX>& shapes,
                         MultiplyRow* row, Eigen::Ref<MatX> result) const {
  constexpr int kRowsAtOnce = 1024;
  const MatX x = shapes.transpose();
  each_task(team_.get(), (size() + kRowsAtOnce - 1) / kRowsAtOnce, [&](int piece, int) {
    const int from = piece * kRowsAtOnce, count = std::min(kRowsAtOnce, size() - from);
    MatX sums(shapes.cols(), count);
    for (int k = 0; k < count; ++k)
      row(matrix, rows_[from + k], position_, x.data(), sums.col(k).data());
    result.middleRows(from, count) = sums.transpose();
  });
}

MatX Structure::embedded(const MatX& shapes) const {
  MatX whole = MatX::Zero(model_.rows(), shapes.cols());
  for (int k = 0; k < size(); ++k) whole.row(rows_[k]) = shapes.row(k);
  return whole;
}

MatX Structure::restricted(const MatX& model_shapes) const {
  MatX part(size(), model_shapes.cols());
  for (int k = 0; k < size(); ++k) part.row(k) = model_shapes.row(rows_[k]);
  return part;
}

}  // namespace mbcosim
