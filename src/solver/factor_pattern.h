/// Where the factors of a matrix have numbers.
#pragma once

#include <vector>

namespace mbcosim {

/// Order of a matrix that is upper triangular by blocks.
struct BlockOrder {
  std::vector<int> row_of, column_of;  ///< P, Q: row and column of the matrix by position (n)
  std::vector<int> block_start;        ///< first position of each diagonal block, then n
};

/// Pattern of the factors of a reference matrix: compressed columns, rows ascending, with the
/// diagonals of L and of U, within diagonal blocks only.
struct FactorPattern : BlockOrder {
  std::vector<int> lower_start, lower_row, upper_start, upper_row;
};

/// Where the columns of the scaled matrix have theirs, by position.
struct MatrixPlaces {
  std::vector<double> inverse_scale;        ///< R⁻¹ (n)
  std::vector<int> value_start;             ///< of each column among the matrix's values (n)
  std::vector<int> entry_start, entry_row;  ///< all entries of a column, in its order
  std::vector<int> above_start, above_row;  ///< those above its diagonal block
};

}  // namespace mbcosim
