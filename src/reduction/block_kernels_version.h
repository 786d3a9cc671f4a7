/// One version of the kernels: included once by each file that is compiled for a processor, which
/// renames Eigen's namespace so that the linker cannot mix versions of its functions. Nothing else
/// that is a template may be used here.
#pragma once

#include <Eigen/Core>
#include <cmath>

#include "reduction/block_kernels.h"

namespace mbcosim {

namespace {

using Matrix = Eigen::MatrixXd;
using Part = Eigen::Map<Matrix, 0, Eigen::OuterStride<>>;
using ConstPart = Eigen::Map<const Matrix, 0, Eigen::OuterStride<>>;
using ConstDiagonal = Eigen::Map<const Eigen::VectorXd>;

constexpr int kPanel = 32;  ///< columns eliminated one by one

/// Column after column of the square on top of `panel`.
int eliminate_columns(Part panel, double* pivots) {
  const int n = static_cast<int>(panel.cols());
  for (int at = 0; at < n; ++at) {
    const double d = panel(at, at);
    if (d == 0 || !(std::abs(d) < HUGE_VAL)) return at;
    pivots[at] = d;
    for (int k = at + 1; k < n; ++k)
      panel.col(k).tail(panel.rows() - k) -=
          (panel(k, at) / d) * panel.col(at).tail(panel.rows() - k);
    panel.col(at).tail(panel.rows() - at - 1) /= d;
    panel(at, at) = 1;
  }
  return -1;
}

/// Panel by panel.
int eliminate(double* block, int rows, int columns, double* pivots) {
  Matrix scaled;
  for (int k = 0; k < columns; k += kPanel) {
    const int width = columns - k < kPanel ? columns - k : kPanel, after = k + width;
    double* const corner = block + static_cast<Eigen::Index>(k) * rows;
    const int broken = eliminate_columns(
        Part(corner + k, rows - k, width, Eigen::OuterStride<>(rows)), pivots + k);
    if (broken >= 0) return k + broken;
    if (after == columns) break;
    const ConstPart lower(corner + after, rows - after, width, Eigen::OuterStride<>(rows));
    Part rest(block + static_cast<Eigen::Index>(after) * rows + after, rows - after,
              columns - after, Eigen::OuterStride<>(rows));
    scaled =
        ConstDiagonal(pivots + k, width).asDiagonal() * lower.topRows(columns - after).transpose();
    rest.noalias() -= lower * scaled;
  }
  return -1;
}

void contribute(const double* lower, int rows, int columns, int height, int targets,
                const double* pivots, double* scaled, double* update) {
  const ConstPart source(lower, height, columns, Eigen::OuterStride<>(rows));
  Part right(scaled, columns, targets, Eigen::OuterStride<>(columns));
  right = ConstDiagonal(pivots, columns).asDiagonal() * source.topRows(targets).transpose();
  Part(update, height, targets, Eigen::OuterStride<>(height)).noalias() = source * right;
}

void solve_lower(const double* block, int rows, int columns, double* own, int order, int sides) {
  const ConstPart square(block, columns, columns, Eigen::OuterStride<>(rows));
  Part x(own, columns, sides, Eigen::OuterStride<>(order));
  square.triangularView<Eigen::UnitLower>().solveInPlace(x);
}

void reach_down(const double* lower, int rows, int columns, int height, const double* own,
                int order, int sides, double* below, int stride) {
  Part(below, height, sides, Eigen::OuterStride<>(stride)).noalias() =
      ConstPart(lower, height, columns, Eigen::OuterStride<>(rows)) *
      ConstPart(own, columns, sides, Eigen::OuterStride<>(order));
}

void reach_up(const double* lower, int rows, int columns, int height, double* own, int order,
              int sides, const double* below) {
  Part(own, columns, sides, Eigen::OuterStride<>(order)).noalias() -=
      ConstPart(lower, height, columns, Eigen::OuterStride<>(rows)).transpose() *
      ConstPart(below, height, sides, Eigen::OuterStride<>(height));
}

void solve_upper(const double* block, int rows, int columns, double* own, int order, int sides) {
  const ConstPart square(block, columns, columns, Eigen::OuterStride<>(rows));
  Part x(own, columns, sides, Eigen::OuterStride<>(order));
  square.transpose().triangularView<Eigen::UnitUpper>().solveInPlace(x);
}

constexpr BlockKernels kernels(const char* processor) {
  return {processor, eliminate, contribute, solve_lower, reach_down, reach_up, solve_upper};
}

}  // namespace

}  // namespace mbcosim
