/// Orders of elimination by minimum degree in which some come after others: CAMD of SuiteSparse.
#pragma once

#include <optional>
#include <vector>

#include "model/sparse_pattern.h"
#include "solver/factor_pattern.h"

namespace mbcosim {

/// Cuts the graph of A + Aᵀ (n, square, without a hole) at its narrowest place near the middle,
/// and orders such that those at the cut come last: the halves can then be eliminated by two
/// threads at the same time. Position k of the result: what is eliminated k-th. Nothing where there
/// is no narrow place (chains have one, solids have none), or where the elimination would take more
/// than 1.1 `operations`: two for a multiplication and subtraction, one for a division, as KLU
/// counts them.
///
/// Levels of a breadth-first search from an end of the graph: George and Liu, "Computer Solution of
/// Large Sparse Positive Definite Systems", 1981, chapters 4 and 8.
std::optional<std::vector<int>> bisected_order(const SparsePattern& pattern, double operations);

/// Orders the largest block for two threads where that costs nothing. `pattern`: of the matrix,
/// which may have more entries than it has.
void bisect_largest_block(const SparsePattern& pattern, double operations, BlockOrder& order);

/// In each block those columns of which `last` is true come last, with the rows that stand at the
/// same places. Nothing where there are none, or where all blocks that have some would take more
/// than 1.1 `operations`.
std::optional<BlockOrder> order_with_last(const SparsePattern& pattern, const BlockOrder& order,
                                          const std::vector<bool>& last, double operations);

}  // namespace mbcosim
