/// Work of the sparse factorization on dense blocks, compiled for several processors.
///
/// A block has `rows` × `columns` numbers, column by column: the columns of L of a supernode, the
/// square of its own rows on top. The versions do the same operations; those with fused multiply
/// and add round differently.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace mbcosim {

/// Numbers of scratch for an elimination with `columns` columns and `targets` rows.
constexpr std::size_t elimination_scratch(int columns, int targets) {
  constexpr std::size_t kTileRows = 24, kSquare = 32 * 33;  // of all versions the largest
  return columns * (targets + kTileRows) + (columns / 32 + 1) * kSquare;
}

struct BlockKernels {
  const char* processor;  ///< "x86-64-v3"

  /// L D Lᵀ of the square on top, in place; the rows below get L; what is above the diagonal is
  /// undefined. Returns the column whose pivot is zero or not finite, or −1. `scratch`:
  /// elimination_scratch(columns, columns).
  int (*eliminate)(double* block, int rows, int columns, double* pivots, double* scratch);
  /// Subtracts L D Uᵀ, with U the first `targets` of the `height` rows of `lower`, from another
  /// block of `block_rows` rows: row and column r of the product belong to its row and column
  /// place[r], ascending. `scratch`: elimination_scratch(columns, targets).
  void (*subtract)(const double* lower, int rows, int columns, int height, int targets,
                   const double* pivots, double* scratch, double* block, int block_rows,
                   const int* place);
  // Substitution with a block for `sides` right sides: `own` has its `columns` rows of a matrix of
  // `order` rows.
  /// own = L⁻¹ own
  void (*solve_lower)(const double* block, int rows, int columns, double* own, int order,
                      int sides);
  /// below = L_below own for `height` rows of the block from `lower` on; `below` is part of a
  /// matrix of `stride` rows.
  void (*reach_down)(const double* lower, int rows, int columns, int height, const double* own,
                     int order, int sides, double* below, int stride);
  /// own −= L_belowᵀ below for `columns` columns of the block from `lower` on, all with `height`
  /// rows.
  void (*reach_up)(const double* lower, int rows, int columns, int height, double* own, int order,
                   int sides, const double* below);
  /// own = L⁻ᵀ own
  void (*solve_upper)(const double* block, int rows, int columns, double* own, int order,
                      int sides);
};

/// The versions that this processor can run, the plainest first.
const std::vector<const BlockKernels*>& block_kernels();
/// By its name; "auto": the last. Null: unknown, or not for this processor.
const BlockKernels* find_block_kernels(const std::string& processor);

/// The versions of the build; null where the compiler has none for that processor.
extern const BlockKernels* const kPlainKernels;
extern const BlockKernels* const kKernelsV3;
extern const BlockKernels* const kKernelsV4;

}  // namespace mbcosim
