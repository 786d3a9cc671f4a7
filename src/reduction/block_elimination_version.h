/// One version of the elimination on dense blocks, by hand: a general product writes a matrix of
/// its own, which is then subtracted from here and there. A tile of products stays in registers
/// until it is subtracted from where it belongs; tiles above the diagonal are left out.
#pragma once

#include <cmath>
#include <cstddef>

#include "reduction/block_kernels.h"

namespace mbcosim {

namespace {

#if defined(__AVX512F__)
constexpr int kLanes = 8, kTileColumns = 8;  ///< kLanes: numbers of a vector
#elif defined(__AVX__)
constexpr int kLanes = 4, kTileColumns = 4;
#else
constexpr int kLanes = 2, kTileColumns = 4;
#endif
constexpr int kTileVectors = 3, kTileRows = kTileVectors * kLanes;
constexpr int kPanel = 32;  ///< columns eliminated one by one
static_assert(elimination_scratch(1, 0) >= kTileRows + kPanel * (kPanel + 1));

using Lanes = double __attribute__((vector_size(kLanes * sizeof(double)), aligned(8), may_alias));

inline const Lanes& at(const double* numbers) { return *reinterpret_cast<const Lanes*>(numbers); }
inline Lanes& at(double* numbers) { return *reinterpret_cast<Lanes*>(numbers); }

/// Where a product belongs in a block: row and column r at its row and column place_of(r).
struct Target {
  double* block;
  std::ptrdiff_t rows;  ///< of the block
  const int* place;     ///< ascending; null: one after the other
  int place_of(int row) const { return place ? place[row] : row; }
};

/// Subtracts `present` rows, from `row` on, of `a` times the columns from `column` on. `a`: column
/// by column with kVectors vectors each; `b`: kColumns numbers for each column of a.
template <int kVectors, int kColumns>
void subtract_tile(const double* a, std::ptrdiff_t stride, const double* b, int depth, int row,
                   int present, int column, const Target& target) {
  double* to[kColumns];
  Lanes sum[kColumns][kVectors];
#pragma GCC unroll 8
  for (int c = 0; c < kColumns; ++c) {
    to[c] = target.block + target.place_of(column + c) * target.rows;
#pragma GCC unroll 4
    for (int v = 0; v < kVectors; ++v) {
      sum[c][v] = Lanes{};
      __builtin_prefetch(to[c] + target.place_of(row + v * kLanes), /*for writing*/ 1);
    }
  }
  for (int k = 0; k < depth; ++k, a += stride, b += kColumns) {
    Lanes number[kVectors];
#pragma GCC unroll 4
    for (int v = 0; v < kVectors; ++v) number[v] = at(a + v * kLanes);
#pragma GCC unroll 8
    for (int c = 0; c < kColumns; ++c)
#pragma GCC unroll 4
      for (int v = 0; v < kVectors; ++v) sum[c][v] += number[v] * b[c];
  }
#pragma GCC unroll 4
  for (int v = 0; v < kVectors; ++v) {
    const int first = row + v * kLanes, place = target.place_of(first);
    const int lanes = present - v * kLanes;
    if (lanes >= kLanes && target.place_of(first + kLanes - 1) - place == kLanes - 1) {
#pragma GCC unroll 8
      for (int c = 0; c < kColumns; ++c) at(to[c] + place) -= sum[c][v];
    } else {
#pragma GCC unroll 8
      for (int c = 0; c < kColumns; ++c)
        for (int k = 0; k < kLanes && k < lanes; ++k)
          to[c][target.place_of(first + k)] -= sum[c][v][k];
    }
  }
}

/// All columns of some rows; `b` has those of a tile together.
template <int kVectors>
void subtract_rows(const double* a, std::ptrdiff_t stride, const double* b, int depth, int row,
                   int present, int columns, const Target& target) {
  int c = 0;
  const auto tiles = [&]<int kColumns>() {
    for (; c + kColumns <= columns; c += kColumns)
      subtract_tile<kVectors, kColumns>(a, stride, b + static_cast<std::ptrdiff_t>(c) * depth,
                                        depth, row, present, c, target);
  };
  tiles.template operator()<kTileColumns>();
  if constexpr (kTileColumns > 4) tiles.template operator()<4>();
  tiles.template operator()<2>();
  tiles.template operator()<1>();
}

/// D Uᵀ with the columns of a tile side by side.
inline void scale_columns(const double* lower, std::ptrdiff_t rows, int depth, int columns,
                          const double* pivots, double* scaled) {
  int c = 0;
  for (int together = kTileColumns; together > 0; together /= 2)
    for (; c + together <= columns; c += together)
      for (int k = 0; k < depth; ++k)
        for (int j = 0; j < together; ++j) *scaled++ = pivots[k] * lower[k * rows + c + j];
}

/// Rows side by side, zeros where they end.
inline void copy_rows(const double* lower, std::ptrdiff_t rows, int depth, int present,
                      int together, double* copy) {
  for (int k = 0; k < depth; ++k, lower += rows, copy += together) {
    for (int i = 0; i < present; ++i) copy[i] = lower[i];
    for (int i = present; i < together; ++i) copy[i] = 0;
  }
}

/// D Uᵀ, scaled, and room for a copy of some rows.
struct Scratch {
  const double* scaled;
  double* copy;
};

/// Subtracts the first `columns` columns of a product for the rows of a tile. `copies`: worth it
/// for that many columns.
inline void subtract_some_rows(const double* lower, std::ptrdiff_t rows, int depth, int row,
                               int present, int columns, const Scratch& scratch, bool copies,
                               const Target& target) {
  const int vectors = (present + kLanes - 1) / kLanes;
  const double* a = lower + row;
  std::ptrdiff_t stride = rows;
  if (copies || present < vectors * kLanes) {
    copy_rows(a, rows, depth, present, vectors * kLanes, scratch.copy);
    a = scratch.copy;
    stride = vectors * kLanes;
  }
  const auto subtract = vectors == 1   ? subtract_rows<1>
                        : vectors == 2 ? subtract_rows<2>
                                       : subtract_rows<kTileVectors>;
  subtract(a, stride, scratch.scaled, depth, row, present, columns, target);
}

/// The lower half of a product.
void subtract_product(const double* lower, std::ptrdiff_t rows, int depth, int height, int columns,
                      const double* pivots, double* numbers, const Target& target) {
  const Scratch scratch{numbers, numbers + static_cast<std::ptrdiff_t>(columns) * depth};
  scale_columns(lower, rows, depth, columns, pivots, numbers);
  for (int row = 0; row < height; row += kTileRows) {
    const int present = height - row < kTileRows ? height - row : kTileRows;
    // Tiles that reach the diagonal are whole.
    const int end = (row + present + kTileColumns - 1) / kTileColumns * kTileColumns;
    subtract_some_rows(lower, rows, depth, row, present, end < columns ? end : columns, scratch,
                       columns > 2 * kTileColumns, target);
  }
}

/// L D Lᵀ of a square. Returns the column whose pivot is zero or not finite, or −1.
inline int eliminate_square(double* square, std::ptrdiff_t rows, int columns, double* pivots) {
  for (int k = 0; k < columns; ++k) {
    double* const column = square + k * rows;
    const double d = column[k];
    if (d == 0 || !(std::abs(d) < HUGE_VAL)) return k;
    pivots[k] = d;
    for (int j = k + 1; j < columns; ++j) {
      const double factor = column[j] / d;
      for (int i = j; i < columns; ++i) square[j * rows + i] -= factor * column[i];
    }
    for (int i = k + 1; i < columns; ++i) column[i] /= d;
    column[k] = 1;
  }
  return -1;
}

/// An eliminated square of at most kPanel columns: its rows one after the other, and 1 / D.
struct Square {
  static constexpr int kNumbers = kPanel * kPanel + kPanel;
  double* numbers;
  double* lower(int row) const { return numbers + row * kPanel; }
  double* inverse() const { return numbers + kPanel * kPanel; }
  void copy(const double* square, std::ptrdiff_t rows, int columns, const double* pivots) const {
    for (int k = 0; k < columns; ++k) {
      inverse()[k] = 1 / pivots[k];
      for (int j = 0; j < k; ++j) lower(k)[j] = square[j * rows + k];
    }
  }
};

/// Rows below an eliminated square.
template <int kVectors>
void solve_vectors(double* first, std::ptrdiff_t rows, int columns, const Square& square) {
  for (int k = 0; k < columns; ++k) {
    Lanes number[kVectors];
#pragma GCC unroll 8
    for (int v = 0; v < kVectors; ++v) number[v] = at(first + k * rows + v * kLanes);
    for (int j = 0; j < k; ++j)
#pragma GCC unroll 8
      for (int v = 0; v < kVectors; ++v)
        number[v] -= square.lower(k)[j] * at(first + j * rows + v * kLanes);
#pragma GCC unroll 8
    for (int v = 0; v < kVectors; ++v) at(first + k * rows + v * kLanes) = number[v];
  }
  for (int k = 0; k < columns; ++k)
#pragma GCC unroll 8
    for (int v = 0; v < kVectors; ++v) at(first + k * rows + v * kLanes) *= square.inverse()[k];
}

inline void solve_rows(double* first, std::ptrdiff_t rows, int height, int columns,
                       const Square& square) {
  constexpr int kVectors = 8;
  int i = 0;
  for (; i + kVectors * kLanes <= height; i += kVectors * kLanes)
    solve_vectors<kVectors>(first + i, rows, columns, square);
  for (; i + kLanes <= height; i += kLanes) solve_vectors<1>(first + i, rows, columns, square);
  for (; i < height; ++i) {
    for (int k = 0; k < columns; ++k)
      for (int j = 0; j < k; ++j) first[k * rows + i] -= square.lower(k)[j] * first[j * rows + i];
    for (int k = 0; k < columns; ++k) first[k * rows + i] *= square.inverse()[k];
  }
}

/// Columns `from` … `to` − 1 of the square on top; those on the left of them are subtracted
/// already.
int eliminate_columns(double* block, int rows, int columns, int from, int to, double* pivots,
                      double* numbers) {
  const std::ptrdiff_t stride = rows;
  if (to - from <= kPanel) {
    double* const corner = block + from * stride + from;
    if (const int broken = eliminate_square(corner, rows, to - from, pivots + from); broken >= 0)
      return from + broken;
    const Square square{numbers};
    square.copy(corner, rows, to - from, pivots + from);
    solve_rows(corner + to - from, rows, columns - to, to - from, square);
    return -1;
  }
  const int half = from + ((to - from) / 2 + kPanel - 1) / kPanel * kPanel;
  if (const int broken = eliminate_columns(block, rows, columns, from, half, pivots, numbers);
      broken >= 0)
    return broken;
  subtract_product(block + from * stride + half, rows, half - from, columns - half, to - half,
                   pivots + from, numbers, {block + half * stride + half, rows, nullptr});
  return eliminate_columns(block, rows, columns, half, to, pivots, numbers);
}

/// The rows below the square, as many together as a cache holds.
void solve_below(double* block, int rows, int columns, const double* pivots, double* numbers) {
  constexpr int kTogether = 4 * kTileRows;
  const std::ptrdiff_t stride = rows;
  const auto each_panel = [&](const auto& use) {  // calls use(first, width, numbers of its own)
    double* own = numbers;
    for (int from = 0; from < columns; from += kPanel) {
      const int width = columns - from < kPanel ? columns - from : kPanel;
      use(from, width, own);
      own += Square::kNumbers + static_cast<std::ptrdiff_t>(from) * width;
    }
    return own;
  };
  double* const copy = each_panel([&](int from, int width, double* own) {
    Square{own}.copy(block + from * stride + from, rows, width, pivots + from);
    scale_columns(block + from, rows, from, width, pivots, own + Square::kNumbers);
  });
  for (int top = columns; top < rows; top += kTogether) {
    const int height = rows - top < kTogether ? rows - top : kTogether;
    each_panel([&](int from, int width, double* own) {
      double* const panel = block + from * stride + top;
      for (int row = 0; from > 0 && row < height; row += kTileRows)
        subtract_some_rows(
            block + top, rows, from, row, height - row < kTileRows ? height - row : kTileRows,
            width, {own + Square::kNumbers, copy}, /*copies=*/false, {panel, rows, nullptr});
      solve_rows(panel, rows, height, width, Square{own});
    });
  }
}

int eliminate(double* block, int rows, int columns, double* pivots, double* scratch) {
  const int broken = eliminate_columns(block, rows, columns, 0, columns, pivots, scratch);
  if (broken < 0) solve_below(block, rows, columns, pivots, scratch);
  return broken;
}

void subtract(const double* lower, int rows, int columns, int height, int targets,
              const double* pivots, double* scratch, double* block, int block_rows,
              const int* place) {
  subtract_product(lower, rows, columns, height, targets, pivots, scratch,
                   {block, block_rows, place});
}

}  // namespace

}  // namespace mbcosim
