/// Sparse matrices of one pattern, and the pattern of their factors the slow way.
#pragma once

#include <Eigen/Dense>
#include <algorithm>
#include <numeric>
#include <random>
#include <utility>
#include <vector>

#include "math/eigen_storage.h"
#include "solver/supernodal_lu.h"

namespace mbcosim {

using Dense = Eigen::MatrixXd;
using Vector = Eigen::VectorXd;

struct Sparse {
  std::vector<int> column_start{0}, row_index;
  std::vector<double> values;
  explicit Sparse(const Dense& a) {
    for (int j = 0; j < a.cols(); ++j) {
      for (int i = 0; i < a.rows(); ++i)
        if (a(i, j) != 0) {
          row_index.push_back(i);
          values.push_back(a(i, j));
        }
      column_start.push_back(static_cast<int>(row_index.size()));
    }
  }
};

/// Pattern of L and U of P A Q without further pivoting, by elimination on a table of flags.
inline FactorPattern factor_pattern(const Dense& a, std::vector<int> row_of,
                                    std::vector<int> column_of, std::vector<int> block_start) {
  const int n = static_cast<int>(a.rows());
  FactorPattern f{
      {std::move(row_of), std::move(column_of), std::move(block_start)}, {0}, {}, {0}, {}};
  std::vector<std::vector<bool>> filled(n, std::vector<bool>(n));
  std::vector<int> block(n);
  for (std::size_t b = 0; b + 1 < f.block_start.size(); ++b)
    for (int k = f.block_start[b]; k < f.block_start[b + 1]; ++k) block[k] = static_cast<int>(b);
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j)
      filled[i][j] = i == j || (block[i] == block[j] && a(f.row_of[i], f.column_of[j]) != 0);
  for (int k = 0; k < n; ++k)
    for (int i = k + 1; i < n; ++i)
      for (int j = k + 1; j < n && filled[i][k]; ++j)
        if (filled[k][j]) filled[i][j] = true;
  for (int j = 0; j < n; ++j) {
    for (int i = 0; i < n; ++i) {
      if (filled[i][j] && i >= j) f.lower_row.push_back(i);
      if (filled[i][j] && i <= j) f.upper_row.push_back(i);
    }
    f.lower_start.push_back(static_cast<int>(f.lower_row.size()));
    f.upper_start.push_back(static_cast<int>(f.upper_row.size()));
  }
  return f;
}

/// Matrices of one pattern, diagonally dominant by columns after the permutation.
class SparseFamily {
 public:
  SparseFamily(int n, double density, std::vector<int> block_start, unsigned seed)
      : block_start_(std::move(block_start)), generator_(seed), pattern_(Dense::Zero(n, n)) {
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j)
        if (i == j || (number(0, 1) < density && block(i) <= block(j))) pattern_(i, j) = 1;
    row_of_.resize(n);
    std::iota(row_of_.begin(), row_of_.end(), 0);
    column_of_ = row_of_;
    std::shuffle(row_of_.begin(), row_of_.end(), generator_);
    std::shuffle(column_of_.begin(), column_of_.end(), generator_);
  }
  Dense matrix() {
    const int n = static_cast<int>(pattern_.rows());
    Dense a = Dense::Zero(n, n);
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j)
        if (pattern_(i, j) != 0)
          a(row_of_[i], column_of_[j]) = i == j ? n * number(.5, 1) : number(-1, 1);
    return a;
  }
  FactorPattern pattern(const Dense& a) const {
    return factor_pattern(a, row_of_, column_of_, block_start_);
  }
  Vector vector() {
    return Vector::NullaryExpr(pattern_.rows(), [&] { return number(-1, 1); });
  }
  double number(double from, double to) {
    return std::uniform_real_distribution<double>(from, to)(generator_);
  }

 private:
  int block(int k) const {
    return static_cast<int>(std::upper_bound(block_start_.begin(), block_start_.end(), k) -
                            block_start_.begin());
  }
  std::vector<int> block_start_, row_of_, column_of_;
  std::mt19937 generator_;
  Dense pattern_;
};

}  // namespace mbcosim
