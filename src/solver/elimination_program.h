/// The elimination of a matrix as a list of operations.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "solver/panel_kernels.h"

namespace mbcosim {

/// What has to be done with an array of numbers F, for every matrix of one pattern:
///
///   F[target] = value · scale                                    first
///   F[target + i] = (F[target + i] − Σ F[factor + i] F[other]) / F[pivot]    update by update
///
/// An update is of one number or of a block: kBlock numbers, the first of them at a multiple of
/// kBlock. Updates are given in an order in which they could be done and come, level by level, in
/// one in which neighbours do not wait for each other; sums keep theirs, so that the results are
/// the same bits. What has been stored as a block is loaded as one: a processor can hand it on
/// before it is in the cache.
class EliminationProgram {
 public:
  static constexpr int kBlock = NumberUpdate::kBlock;

  explicit EliminationProgram(std::size_t numbers) {
    draft_.emplace().uses.resize(numbers / kBlock + 1);
  }
  /// `value`: which of those that `run` gets.
  void set(std::size_t target, int value, double scale);
  /// Begins an update of `count` numbers, 1 or kBlock.
  void begin(std::size_t target, int count);
  void subtract_product(std::size_t factor, std::size_t other);
  void end(std::optional<std::size_t> pivot = {});
  void finish();  ///< after the last operation

  /// Divisions by zero give numbers that are not finite.
  void run(const PanelVersion& version, const double* values, double* numbers) const;
  std::size_t bytes() const;

 private:
  struct Entry {
    int value;
    std::uint32_t target;
    double scale;
  };
  /// Levels of a block's numbers.
  struct Uses {
    int ready = 0;  ///< in which they can be used
    int read = -1;  ///< the last one in which they are needed as they are
  };
  struct Update {
    NumberUpdate what;
    std::size_t first;  ///< product
    int level;
  };
  /// Until `finish`. What grows is not moved: for a large matrix that would take most of the time.
  struct Draft {
    std::vector<Uses> uses;  ///< by block
    std::deque<Entry> entries;
    std::deque<Update> updates;
    std::deque<NumberProduct> products;
    Update open{};  ///< the update that has begun
  };
  Uses& uses_of(std::size_t place) { return draft_->uses[place / kBlock]; }
  bool extends_last(const Update& update) const;
  void mark(const Update& update);

  std::vector<Entry> entries_;
  std::vector<NumberUpdate> updates_;
  std::vector<NumberProduct> products_;
  std::optional<Draft> draft_;
};

}  // namespace mbcosim
