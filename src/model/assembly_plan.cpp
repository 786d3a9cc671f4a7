#include "model/assembly_plan.h"

#include <algorithm>
#include <bit>
#include <numeric>

#include "model/model.h"

namespace mbcosim {

namespace {

constexpr std::size_t kSmall = 32768;  ///< entries of a matrix that is not cut: 256 kB
// Entries in a tile of a larger one. Threads are busy alike with kTiles; beyond them tiles grow, as
// whatever is read in one stream after the other comes faster, as long as they fit into a cache.
constexpr std::size_t kLeast = 8192, kMost = 131072;
constexpr std::size_t kTiles = 64;

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
  if (entries < kSmall) {
    begun_ = {{0, static_cast<int>(entries)}};
    begun_start_ = {0, 1, 1};
    return;
  }
  const int tiles =
      static_cast<int>(std::max(std::min(kTiles, 1 + entries / kLeast), 1 + entries / kMost));
  order_.resize(tiles);
  std::vector<int> wave_of(tiles), rows;
  std::vector<int> first_of_row(model.unknowns, -1);
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
    for (const int row : rows)
      if (row >= 0 && (first_of_row[row] < 0 || wave_of[first_of_row[row]] > wave_of[tile]))
        first_of_row[row] = tile;
  }
  wave_start_.assign(*std::max_element(wave_of.begin(), wave_of.end()) + 2, 0);
  for (const int wave : wave_of) ++wave_start_[wave + 1];
  std::partial_sum(wave_start_.begin(), wave_start_.end(), wave_start_.begin());
  std::vector<int> next(wave_start_.begin(), wave_start_.end() - 1);
  for (int tile = 0; tile < tiles; ++tile) order_[next[wave_of[tile]]++] = tile;
  find_first(model, wave_of, first_of_row);
}

// Who adds to a column adds to one of its rows: the first tile of all its rows is the first of the
// column. A column that two tiles of that wave add to is nobody's.
void AssemblyPlan::find_first(const Model& model, const std::vector<int>& wave_of,
                              const std::vector<int>& first_of_row) {
  const int nobody = static_cast<int>(wave_of.size());
  std::vector<std::vector<ValueRange>> begun(wave_of.size() + 1);
  for (int column = 0; column < model.unknowns; ++column) {
    const ValueRange values{model.column_start[column], model.column_start[column + 1]};
    int first = -1;
    bool alone = true;
    for (int k = values.first; k < values.last; ++k) {
      const int tile = first_of_row[model.row_index[k]];
      if (tile < 0 || tile == first) continue;
      if (first < 0 || wave_of[tile] < wave_of[first])
        first = tile, alone = true;
      else if (wave_of[tile] == wave_of[first])
        alone = false;
    }
    std::vector<ValueRange>& own = begun[first >= 0 && alone ? first : nobody];
    if (!own.empty() && own.back().last == values.first)
      own.back().last = values.last;
    else if (values.first < values.last)
      own.push_back(values);
  }
  begun_start_.assign(1, 0);
  for (const std::vector<ValueRange>& own : begun) {
    begun_.insert(begun_.end(), own.begin(), own.end());
    begun_start_.push_back(static_cast<int>(begun_.size()));
  }
}

}  // namespace mbcosim
