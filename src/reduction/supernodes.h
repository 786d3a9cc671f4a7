/// Columns of a sparse factor gathered where their patterns are (nearly) the same, so that the
/// numbers can be kept and worked on as dense blocks.
#pragma once

#include <vector>

#include "reduction/elimination_order.h"

namespace mbcosim {

/// The pattern of L in P A Pᵀ = L D Lᵀ. Block s has the columns first[s] … first[s + 1] − 1; its
/// rows are these and then the ones below, all in the order of elimination.
struct Supernodes {
  std::vector<int> order;              ///< row of the matrix that is eliminated k-th
  std::vector<int> place;              ///< its inverse
  std::vector<int> first;              ///< (blocks + 1)
  std::vector<int> of_column;          ///< block
  std::vector<std::size_t> rows_from;  ///< (blocks + 1), in `rows`
  std::vector<int> rows;               ///< ascending in each block

  int count() const { return static_cast<int>(first.size()) - 1; }
  int width(int s) const { return first[s + 1] - first[s]; }
  int height(int s) const { return static_cast<int>(rows_from[s + 1] - rows_from[s]); }
  const int* rows_of(int s) const { return rows.data() + rows_from[s]; }
};

Supernodes find_supernodes(const SparseMatrix& matrix, const RowPlaces& places);

}  // namespace mbcosim
