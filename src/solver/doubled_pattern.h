/// Pattern of a 2×2 arrangement of the model's pattern, compressed columns: column j of a half
/// holds the rows of the upper block, then those of the lower one.
#pragma once

#include <vector>

#include "model/model.h"
#include "solver/linear_solver.h"

namespace mbcosim {

inline SparsePattern doubled_pattern(const std::vector<int>& column_start,
                                     const std::vector<int>& row_index) {
  SparsePattern p;
  p.column_start.push_back(0);
  const int n = static_cast<int>(column_start.size()) - 1;
  for (int half = 0; half < 2; ++half)
    for (int j = 0; j < n; ++j) {
      for (const int shift : {0, n})
        for (int k = column_start[j]; k < column_start[j + 1]; ++k)
          p.row_index.push_back(shift + row_index[k]);
      p.column_start.push_back(static_cast<int>(p.row_index.size()));
    }
  return p;
}

/// A solver for matrices of that arrangement of `pattern`, which holds the model's own.
inline LinearSolver doubled_solver(const Model& m, const SparsePattern& pattern) {
  const SparsePattern p = doubled_pattern(pattern.column_start, pattern.row_index);
  const SparsePattern c = doubled_pattern(m.couplings.column_start, m.couplings.row_index);
  return LinearSolver(2 * m.unknowns, p.column_start, p.row_index, c);
}

}  // namespace mbcosim
