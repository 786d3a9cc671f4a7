/// In which order the elements of a model add to its residual and its matrix.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "model/element_set.h"
#include "model/fwd.h"

namespace mbcosim {

/// From `first` to before `last`, among the values of a matrix.
struct ValueRange {
  int first = 0, last = 0;
};

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
  /// Values of the matrix that a tile is the first to add to, and alone in its wave: it sets them
  /// to zero before, while it has them in the cache.
  std::span<const ValueRange> begun_by(int tile) const {
    return {begun_.data() + begun_start_[tile], begun_.data() + begun_start_[tile + 1]};
  }
  /// The others: to be set to zero before the first wave.
  std::span<const ValueRange> begun_before() const {
    return begun_by(static_cast<int>(order_.size()));
  }

 private:
  void find_first(const Model& model, const std::vector<int>& wave_of,
                  const std::vector<int>& first_of_row);

  std::vector<int> order_{0};          ///< tiles, wave by wave
  std::vector<int> wave_start_{0, 1};  ///< in order_; (waves + 1)
  std::vector<ValueRange> begun_;
  std::vector<int> begun_start_{0, 0, 0};  ///< in begun_; (tiles + 2), those of nobody last
};

}  // namespace mbcosim
