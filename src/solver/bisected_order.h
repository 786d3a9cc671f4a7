/// An order of elimination for two threads.
#pragma once

#include <optional>
#include <vector>

#include "model/sparse_pattern.h"

namespace mbcosim {

/// Cuts the graph of A + Aᵀ (n, square, without a hole) at its narrowest place near the middle,
/// and orders by minimum degree such that those at the cut come last: the halves can then be
/// eliminated at the same time. Position k of the result: what is eliminated k-th. Nothing where
/// there is no narrow place (chains have one, solids have none), or where the elimination would
/// take more than 1.1 `operations`: two for a multiplication and subtraction, one for a division,
/// as KLU counts them.
///
/// Levels of a breadth-first search from an end of the graph: George and Liu, "Computer Solution of
/// Large Sparse Positive Definite Systems", 1981, chapters 4 and 8. Order under constraints: CAMD
/// of SuiteSparse.
std::optional<std::vector<int>> bisected_order(const SparsePattern& pattern, double operations);

}  // namespace mbcosim
