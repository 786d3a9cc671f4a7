/// Work of the LU factorization, compiled for several processors: on the panel of a supernode, for
/// several columns of the matrix side by side, and by lists of operations. All versions do the same
/// operations in the same order without fused multiply and add: their numbers are the same bit by
/// bit, whatever the number of columns.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace mbcosim {

/// Columns of L that begin in row `first`: own rows, then those of a list, `stride` numbers apart.
struct Panel {
  const double* numbers;  ///< of the first column, at row `first` itself, which is not read
  std::ptrdiff_t stride;
  int first;        ///< position
  int width;        ///< columns
  int own;          ///< rows first + width .. are the supernode's own, without a list
  const int* rows;  ///< positions of the rows below
  int below;        ///< their count
};

constexpr int kMostColumns = 16;  ///< side by side, in any version

/// For one number of columns side by side: X is row by row, `columns` numbers each.
struct PanelKernels {
  int columns;
  /// Rows first .. first + width − 1 of X := L⁻¹ X, the rows below minus L times them.
  void (*eliminate)(const Panel& panel, double* x);
  /// The column of L below row `first` := column `place` of X / pivot; X −= it times `u` (columns).
  void (*finish)(const Panel& panel, double* column, int place, double pivot, const double* u,
                 double* x);
  void (*clear)(const int* rows, int count, double* x);  ///< rows of X
};

/// Of arrays F and X, which may be one, to numbers of X from `target` on: minus products, then
/// divided by F[pivot] where it `divides`. `dots`: one number, minus products of blocks.
struct NumberUpdate {
  static constexpr int kBlock = 4;          ///< numbers that are loaded and stored together
  static constexpr int kMost = 3 * kBlock;  ///< in one update

  std::uint32_t target, pivot, products;
  std::uint16_t count;  ///< 1 or some blocks
  bool divides, dots;
  bool operator==(const NumberUpdate&) const = default;
};

/// F[factor], and its neighbours for those of the target, times X[other]; of a dot F[factor + i]
/// X[other + i] for a block, the last i first.
struct NumberProduct {
  std::uint32_t factor, other;
  bool operator==(const NumberProduct&) const = default;
};

struct PanelVersion {
  static constexpr int kWidths = 3;

  const char* processor;          ///< "x86-64-v3"
  PanelKernels kernels[kWidths];  ///< for more and more columns; no more come together than last
  int lanes;                      ///< numbers in a register
  /// All of a list one after the other, each with as many products as it has; returns what is
  /// behind the last of them.
  const NumberProduct* (*update)(const NumberUpdate* updates, std::size_t count,
                                 const NumberProduct* products, const double* f, double* x);
  const PanelKernels& of(int columns) const {
    const PanelKernels* each = kernels;
    while (each->columns < columns) ++each;
    return *each;
  }
  int most_columns() const { return kernels[kWidths - 1].columns; }
  /// Of a product of a panel with so many columns, in operations on registers: those on X, and what
  /// goes with them.
  double cost_of(int columns) const {
    constexpr double kOther = 0.5;
    return columns == 1 ? 1 + kOther : kOther + (of(columns).columns + lanes - 1) / lanes;
  }
};

/// The versions that this processor can run, the plainest first.
const std::vector<const PanelVersion*>& panel_versions();

/// The version of the build; null where the compiler has none for that processor.
extern const PanelVersion *const kPanelVersionV3, *const kPanelVersionV4;

}  // namespace mbcosim
