/// One version of the kernels: included once by each file that is compiled for a processor, which
/// renames Eigen's namespace so that the linker cannot mix versions of its functions. No other
/// templates may be used here but those of its unnamed namespace.
#pragma once

#include "math/eigen_storage.h"  // of the renamed namespace, too
#include "reduction/block_elimination_version.h"

namespace mbcosim {

namespace {

using Matrix = Eigen::MatrixXd;
using Part = Eigen::Map<Matrix, 0, Eigen::OuterStride<>>;
using ConstPart = Eigen::Map<const Matrix, 0, Eigen::OuterStride<>>;

void solve_lower(const double* block, int rows, int columns, double* own, int order, int sides) {
  const ConstPart square(block, columns, columns, Eigen::OuterStride<>(rows));
  Part x(own, columns, sides, Eigen::OuterStride<>(order));
  square.triangularView<Eigen::UnitLower>().solveInPlace(x);
}

// Eight sides at a time by hand: a general product copies the block before it uses it, which takes
// longer than these few products. The block is read once, down its columns.

constexpr int kSides = 8, kRowsAtOnce = 256;

/// below += the next kColumns columns times their rows of own; `own`: row by row.
template <int kColumns>
inline void add_columns(const double* lower, int rows, int height, const double* own, double* below,
                        int stride) {
  int i = 0;
  for (; i + kLanes <= height; i += kLanes) {
    Lanes number[kColumns];
#pragma GCC unroll 4
    for (int k = 0; k < kColumns; ++k)
      number[k] = at(lower + static_cast<Eigen::Index>(k) * rows + i);
#pragma GCC unroll 8
    for (int c = 0; c < kSides; ++c) {
      Lanes sum = at(below + static_cast<Eigen::Index>(c) * stride + i);
#pragma GCC unroll 4
      for (int k = 0; k < kColumns; ++k) sum += number[k] * own[k * kSides + c];
      at(below + static_cast<Eigen::Index>(c) * stride + i) = sum;
    }
  }
  for (; i < height; ++i)
    for (int c = 0; c < kSides; ++c)
      for (int k = 0; k < kColumns; ++k)
        below[static_cast<Eigen::Index>(c) * stride + i] +=
            lower[static_cast<Eigen::Index>(k) * rows + i] * own[k * kSides + c];
}

void reach_down_eight(const double* lower, int rows, int columns, int height, const double* own,
                      int order, double* below, int stride) {
  constexpr int kColumnsAtOnce = 64, kTogether = 4;
  double by_rows[kColumnsAtOnce * kSides];
  for (int c = 0; c < kSides; ++c)
    for (int i = 0; i < height; ++i) below[static_cast<Eigen::Index>(c) * stride + i] = 0;
  for (int from = 0; from < columns; from += kColumnsAtOnce) {
    const int count = columns - from < kColumnsAtOnce ? columns - from : kColumnsAtOnce;
    for (int c = 0; c < kSides; ++c)
      for (int k = 0; k < count; ++k)
        by_rows[k * kSides + c] = own[static_cast<Eigen::Index>(c) * order + from + k];
    for (int top = 0; top < height; top += kRowsAtOnce) {
      const int part = height - top < kRowsAtOnce ? height - top : kRowsAtOnce;
      const double* const column = lower + static_cast<Eigen::Index>(from) * rows + top;
      int k = 0;
      for (; k + kTogether <= count; k += kTogether)
        add_columns<kTogether>(column + static_cast<Eigen::Index>(k) * rows, rows, part,
                               by_rows + k * kSides, below + top, stride);
      for (; k < count; ++k)
        add_columns<1>(column + static_cast<Eigen::Index>(k) * rows, rows, part,
                       by_rows + k * kSides, below + top, stride);
    }
  }
}

inline double sum_of(Lanes lanes) {
  double sum = 0;
#pragma GCC unroll 8
  for (int k = 0; k < kLanes; ++k) sum += lanes[k];
  return sum;
}

/// own −= kColumns columns, transposed, times below.
template <int kColumns>
void subtract_products(const double* lower, int rows, int height, double* own, int order,
                       const double* below, int stride) {
  Lanes sum[kSides][kColumns] = {};
  int i = 0;
  for (; i + kLanes <= height; i += kLanes)
#pragma GCC unroll 8
    for (int c = 0; c < kSides; ++c)
#pragma GCC unroll 2
      for (int k = 0; k < kColumns; ++k)
        sum[c][k] += at(lower + static_cast<Eigen::Index>(k) * rows + i) *
                     at(below + static_cast<Eigen::Index>(c) * stride + i);
#pragma GCC unroll 8
  for (int c = 0; c < kSides; ++c)
#pragma GCC unroll 2
    for (int k = 0; k < kColumns; ++k) {
      double all = sum_of(sum[c][k]);
      for (int j = i; j < height; ++j)
        all += lower[static_cast<Eigen::Index>(k) * rows + j] *
               below[static_cast<Eigen::Index>(c) * stride + j];
      own[static_cast<Eigen::Index>(c) * order + k] -= all;
    }
}

void reach_up_eight(const double* lower, int rows, int columns, int height, double* own, int order,
                    const double* below) {
  constexpr int kTogether = kLanes == 8 ? 2 : 1;  // as many as there are registers for
  for (int top = 0; top < height; top += kRowsAtOnce) {
    const int part = height - top < kRowsAtOnce ? height - top : kRowsAtOnce;
    int k = 0;
    for (; k + kTogether <= columns; k += kTogether)
      subtract_products<kTogether>(lower + static_cast<Eigen::Index>(k) * rows + top, rows, part,
                                   own + k, order, below + top, height);
    for (; k < columns; ++k)
      subtract_products<1>(lower + static_cast<Eigen::Index>(k) * rows + top, rows, part, own + k,
                           order, below + top, height);
  }
}

void reach_down(const double* lower, int rows, int columns, int height, const double* own,
                int order, int sides, double* below, int stride) {
  int c = 0;
  for (; c + kSides <= sides; c += kSides)
    reach_down_eight(lower, rows, columns, height, own + static_cast<Eigen::Index>(c) * order,
                     order, below + static_cast<Eigen::Index>(c) * stride, stride);
  if (c == sides) return;
  Part(below + static_cast<Eigen::Index>(c) * stride, height, sides - c,
       Eigen::OuterStride<>(stride))
      .noalias() = ConstPart(lower, height, columns, Eigen::OuterStride<>(rows)) *
                   ConstPart(own + static_cast<Eigen::Index>(c) * order, columns, sides - c,
                             Eigen::OuterStride<>(order));
}

void reach_up(const double* lower, int rows, int columns, int height, double* own, int order,
              int sides, const double* below) {
  int c = 0;
  for (; c + kSides <= sides; c += kSides)
    reach_up_eight(lower, rows, columns, height, own + static_cast<Eigen::Index>(c) * order, order,
                   below + static_cast<Eigen::Index>(c) * height);
  if (c == sides) return;
  Part(own + static_cast<Eigen::Index>(c) * order, columns, sides - c, Eigen::OuterStride<>(order))
      .noalias() -= ConstPart(lower, height, columns, Eigen::OuterStride<>(rows)).transpose() *
                    ConstPart(below + static_cast<Eigen::Index>(c) * height, height, sides - c,
                              Eigen::OuterStride<>(height));
}

void solve_upper(const double* block, int rows, int columns, double* own, int order, int sides) {
  const ConstPart square(block, columns, columns, Eigen::OuterStride<>(rows));
  Part x(own, columns, sides, Eigen::OuterStride<>(order));
  square.transpose().triangularView<Eigen::UnitUpper>().solveInPlace(x);
}

constexpr BlockKernels kernels(const char* processor) {
  return {processor, eliminate, subtract, solve_lower, reach_down, reach_up, solve_upper};
}

}  // namespace

}  // namespace mbcosim
