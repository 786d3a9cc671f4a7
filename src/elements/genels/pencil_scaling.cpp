#include "elements/genels/pencil_scaling.h"

#include <algorithm>
#include <cmath>

namespace mbcosim {

namespace {

/// Exponents of rows and columns, and their likes.
struct Exponents {
  VecX rows, columns;

  explicit Exponents(int n) : rows(VecX::Zero(n)), columns(VecX::Zero(n)) {}
  double dot(const Exponents& other) const {
    return rows.dot(other.rows) + columns.dot(other.columns);
  }
  void add(double factor, const Exponents& other) {
    rows += factor * other.rows;
    columns += factor * other.columns;
  }
  double largest() const {
    return std::max(rows.cwiseAbs().maxCoeff(), columns.cwiseAbs().maxCoeff());
  }
};

/// Calls function(row, column, value) for the entries of both matrices that are not zero.
template <class Function>
void each_entry(const MatX& A, const MatX& E, Function function) {
  for (int i = 0; i < A.rows(); ++i)
    for (int j = 0; j < A.cols(); ++j)
      for (const MatX* m : {&A, &E})
        if ((*m)(i, j) != 0) function(i, j, (*m)(i, j));
}

/// Normal equations of the least squares: Σ over the entries of row i and column j of (rᵢ + cⱼ).
Exponents apply_normal_matrix(const MatX& A, const MatX& E, const Exponents& x) {
  Exponents sum(static_cast<int>(A.rows()));
  each_entry(A, E, [&](int i, int j, double) {
    sum.rows(i) += x.rows(i) + x.columns(j);
    sum.columns(j) += x.rows(i) + x.columns(j);
  });
  return sum;
}

/// What preconditions: the inverse of the normal matrix of full matrices.
Exponents precondition(const Exponents& residual) {
  const int n = static_cast<int>(residual.rows.size());
  const double weight = 1. / (2 * n), shift = weight * weight / 2;
  const double row_sum = residual.rows.sum(), column_sum = residual.columns.sum();
  Exponents x(n);
  x.add(weight, residual);
  x.rows.array() += shift * (column_sum - 3 * row_sum);
  x.columns.array() += shift * (row_sum - 3 * column_sum);
  return x;
}

VecX powers_of_ten(const VecX& exponents) {
  return exponents.unaryExpr([](double x) { return std::pow(10., std::round(x)); });
}

}  // namespace

PencilScales scale_pencil(const MatX& A, const MatX& E) {
  const int n = static_cast<int>(A.rows());
  if (n == 1) return {VecX::Ones(1), VecX::Ones(1)};
  Exponents x(n), residual(n), direction(n);
  each_entry(A, E, [&](int i, int j, double value) {
    residual.rows(i) -= std::log10(std::abs(value));
    residual.columns(j) -= std::log10(std::abs(value));
  });
  constexpr double kRounding = 1e-20;  // of a decrease
  double previous = 0;
  for (int iteration = 1; iteration <= n + 2; ++iteration) {
    const Exponents z = precondition(residual);
    const double decrease = residual.dot(z);
    if (decrease < kRounding) break;
    const double kept = iteration == 1 ? 0 : decrease / previous;
    direction.rows *= kept;
    direction.columns *= kept;
    direction.add(1, z);
    const Exponents image = apply_normal_matrix(A, E, direction);
    const double length = decrease / direction.dot(image);
    x.add(length, direction);
    if (std::abs(length) * direction.largest() < .5) break;
    residual.add(-length, image);
    previous = decrease;
  }
  return {powers_of_ten(x.rows), powers_of_ten(x.columns)};
}

}  // namespace mbcosim
