/// Where a sparse matrix has entries.
#pragma once

#include <vector>

namespace mbcosim {

/// Compressed columns: column_start (columns + 1), rows ascend within a column.
struct SparsePattern {
  std::vector<int> column_start, row_index;
  bool operator==(const SparsePattern&) const = default;
};

}  // namespace mbcosim
