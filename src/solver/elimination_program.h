/// The elimination of a matrix as a list of operations.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <unordered_map>
#include <vector>

#include "solver/panel_kernels.h"

namespace mbcosim {

/// Where numbers lie that will be needed, to fetch them some at a time.
class NumberRanges {
 public:
  /// None, when they are more than what caches should be asked for.
  void add(const double* first, std::size_t count);
  std::size_t lines() const;  ///< of a cache
  void fetch(std::size_t lines);

 private:
  struct Range {
    const double *first, *end;
    std::size_t lines() const;
  };
  std::array<Range, 3> ranges_;
  std::size_t count_ = 0, next_ = 0;
};

/// What has to be done with an array of numbers F, for every matrix of one pattern:
///
///   F[target + i] = 0
///   F[target] = value · scale
///   F[target + i] = (F[target + i] − Σ F[factor + i] F[other]) / F[pivot]
///   F[target] = (F[target] − Σ Σ_i F[factor + i] F[other + i]) / F[pivot]    the last i first
///
/// An update is of one number or of a block: kBlock numbers, the first of them at a multiple of
/// kBlock. Operations are given in an order in which they could be done, in windows whose numbers
/// and lists fit into the caches of a core. In each window zeros come first, then values, then
/// updates: level by level, so that neighbours do not wait for each other. Sums keep their order,
/// so that the results are the same bits. What has been stored as a block is loaded as one: a
/// processor can hand it on before it is in the cache.
///
/// Windows that do the same further on, as in a structure that repeats itself (a beam, a cable),
/// share one list: it stays in the caches. Of numbers that do not, those of the next window are
/// fetched during each one.
class EliminationProgram {
 public:
  static constexpr int kBlock = NumberUpdate::kBlock;

  explicit EliminationProgram(std::size_t numbers) : fetches_(numbers > kCached) {
    draft_.emplace().uses.resize(numbers / kBlock + 1);
  }
  void clear(std::size_t target, std::size_t count);
  /// `value`, `scale`: which of those that `run` gets.
  void set(std::size_t target, int value, int scale);
  /// Begins an update of `count` numbers, 1 or kBlock.
  void begin(std::size_t target, int count);
  void subtract_product(std::size_t factor, std::size_t other);
  /// Of two blocks; in an update of one number, after which it has no other products than these.
  void subtract_dot(std::size_t factor, std::size_t other);
  void end(std::optional<std::size_t> pivot = {});
  void require(std::size_t pivot);  ///< as it is now neither zero nor infinite nor not a number
  void end_window();                ///< after an operation whose next one begins another window
  void finish();                    ///< after the last operation

  /// Of the required numbers.
  struct Sizes {
    double smallest = HUGE_VAL, largest = 0;
  };
  /// None when a number is not as it is required: the rest has not been done then. Divisions by
  /// zero give numbers that are not finite.
  std::optional<Sizes> run(const PanelVersion& version, const double* values, const double* scales,
                           double* numbers) const;
  std::size_t bytes() const { return bytes_ + sizeof(Window) * windows_.size(); }

 private:
  struct Zeros {
    std::uint32_t target, count;
    bool operator==(const Zeros&) const = default;
  };
  struct Entry {
    int value, scale;
    std::uint32_t target;
    bool operator==(const Entry&) const = default;
  };
  /// What windows do. Values, scales and places count from the window's first ones, of factors and
  /// pivots apart from all others.
  struct Operations {
    std::vector<Zeros> zeros;
    std::vector<Entry> entries;
    std::vector<NumberUpdate> updates;
    std::vector<NumberProduct> products;
    std::vector<std::uint32_t> required;
    std::size_t values_end = 0, factors_end = 0, numbers_end = 0;
    std::uint64_t digest() const;
    std::size_t bytes() const;
    bool operator==(const Operations&) const = default;
  };
  struct Window {
    int operations, value = 0, scale = 0;
    std::uint32_t factor = 0, number = 0;  ///< multiples of kBlock
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
  /// Until `finish`: the window that is open.
  struct Draft {
    std::vector<Uses> uses;  ///< by block
    std::vector<Zeros> zeros;
    std::vector<Entry> entries;
    std::vector<Update> updates;
    std::vector<NumberProduct> products;
    std::vector<std::uint32_t> required;
    std::unordered_map<std::uint64_t, int> known;  ///< operations by digest
    int first_level = 0, end_level = 0;
    Update open{};  ///< the update that has begun
  };
  Uses& uses_of(std::size_t place) { return draft_->uses[place / kBlock]; }
  bool extends_last(const Update& update) const;
  void mark(const Update& update);
  Operations sorted();
  static Window count_from_first(Operations& operations);
  NumberRanges ranges(const Window& window, const double* values, const double* numbers) const;

  static constexpr std::size_t kCached = 1 << 21;  ///< numbers: 16 MB

  bool fetches_;
  std::size_t bytes_ = 0;  ///< of operations
  std::vector<Operations> operations_;
  std::vector<Window> windows_;
  std::optional<Draft> draft_;
};

}  // namespace mbcosim
