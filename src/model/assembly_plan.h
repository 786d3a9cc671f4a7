/// In which order the elements of a model add to its residual and its matrix.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "model/element_set.h"
#include "model/fwd.h"

namespace mbcosim {

/// Elements in tiles that fit into a cache: those that are close in the deck are close in the
/// model, and what one set has just touched the next one needs. The tiles of a wave add to
/// different rows, so that threads may share them; waves follow each other. Hence all sums are the
/// same bits for every number of threads. Small models are one tile.
class AssemblyPlan {
 public:
  AssemblyPlan() = default;
  /// Of a model with numbered unknowns and a pattern.
  explicit AssemblyPlan(const Model& model);

  int waves() const { return static_cast<int>(wave_start_.size()) - 1; }
  std::span<const int> wave(int w) const {
    return {order_.data() + wave_start_[w], order_.data() + wave_start_[w + 1]};
  }
  /// Those of a set of `size` elements that are in a tile.
  ElementRange elements(int tile, std::int64_t size) const {
    const auto tiles = static_cast<std::int64_t>(order_.size());
    return {static_cast<int>(size * tile / tiles), static_cast<int>(size * (tile + 1) / tiles)};
  }

 private:
  std::vector<int> order_{0};          ///< tiles, wave by wave
  std::vector<int> wave_start_{0, 1};  ///< in order_; (waves + 1)
};

}  // namespace mbcosim
