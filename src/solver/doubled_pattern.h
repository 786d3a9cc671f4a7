/// Pattern of a 2×2 arrangement of the model's pattern, compressed columns: column j of a half
/// holds the rows of the upper block, then those of the lower one.
#pragma once

#include <vector>

#include "model/model.h"

namespace mbcosim {

struct DoubledPattern {
  std::vector<int> column_start{0}, row_index;
  explicit DoubledPattern(const Model& model) {
    const int n = model.unknowns;
    for (int half = 0; half < 2; ++half)
      for (int j = 0; j < n; ++j) {
        for (const int shift : {0, n})
          for (int k = model.column_start[j]; k < model.column_start[j + 1]; ++k)
            row_index.push_back(shift + model.row_index[k]);
        column_start.push_back(static_cast<int>(row_index.size()));
      }
  }
};

}  // namespace mbcosim
