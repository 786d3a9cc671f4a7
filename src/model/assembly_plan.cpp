#include "model/assembly_plan.h"

#include <algorithm>
#include <bit>
#include <numeric>

#include "model/model.h"

namespace mbcosim {

namespace {

constexpr std::size_t kSmall = 32768;  ///< entries of a matrix that is not cut: 256 kB
constexpr std::size_t kTile = 8192;    ///< entries in a tile of a larger one

/// Gives each tile the first wave in which no other has one of its rows.
class Waves {
 public:
  explicit Waves(int rows) : taken_(rows, 0) {}
  int of(const std::vector<int>& rows) {
    std::uint64_t taken = 0;
    for (const int row : rows)
      if (row >= 0) taken |= taken_[row];
    const int wave = std::countr_one(taken);
    if (wave == kWaves) return kWaves + alone_++;
    for (const int row : rows)
      if (row >= 0) taken_[row] |= std::uint64_t{1} << wave;
    return wave;
  }

 private:
  static constexpr int kWaves = 64;  ///< that several tiles can share
  std::vector<std::uint64_t>
      taken_;      ///< by row: a bit for each wave in which it has been given away
  int alone_ = 0;  ///< tiles that found none
};

}  // namespace

AssemblyPlan::AssemblyPlan(const Model& model) {
  const std::size_t entries = model.row_index.size();
  if (entries < kSmall) return;
  const int tiles = static_cast<int>(1 + entries / kTile);
  order_.resize(tiles);
  std::vector<int> wave_of(tiles), rows;
  Waves waves(model.unknowns);
  for (int tile = 0; tile < tiles; ++tile) {
    rows.clear();
    const ElementRange nodes = elements(tile, model.node_equations.size());
    for (int k = nodes.first; k < nodes.last; ++k) model.node_equations.append_rows(k, rows);
    for (const auto& set : model.sets) {
      const ElementRange range = elements(tile, set->size());
      for (int i = range.first; i < range.last; ++i) set->append_rows(model, i, rows);
    }
    wave_of[tile] = waves.of(rows);
  }
  wave_start_.assign(*std::max_element(wave_of.begin(), wave_of.end()) + 2, 0);
  for (const int wave : wave_of) ++wave_start_[wave + 1];
  std::partial_sum(wave_start_.begin(), wave_start_.end(), wave_start_.begin());
  std::vector<int> next(wave_start_.begin(), wave_start_.end() - 1);
  for (int tile = 0; tile < tiles; ++tile) order_[next[wave_of[tile]]++] = tile;
}

}  // namespace mbcosim
