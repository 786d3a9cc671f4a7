/// The elimination of a matrix as a list of operations.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

namespace mbcosim {

/// What has to be done with an array of numbers F, for every matrix of one pattern:
///
///   F[target] = value · scale                         first
///   F[target + i] −= F[factor + i] F[other]           level by level; at the end of a level
///   F[target + i] /= F[pivot]
///
/// each for a run of neighbours i. Operations are given in the order in which they would be done
/// one after the other. Levels keep the order of all that touch the same number, so that the
/// results are the same bits. Where columns are short it is loops of a few rounds that cost time,
/// not arithmetic; here there are two for each level.
class EliminationProgram {
 public:
  /// `numbers`: of F.
  explicit EliminationProgram(std::size_t numbers) { draft_.emplace().uses.resize(numbers); }
  /// `value`: which of those that `run` gets.
  void set(std::size_t target, int value, double scale);
  /// Of `count` numbers each, none of which is `other`; runs do not overlap.
  void subtract_products(std::size_t target, std::size_t factor, std::size_t count,
                         std::size_t other);
  void divide(std::size_t target, std::size_t count, std::size_t pivot);
  void finish();  ///< after the last operation

  /// Divisions by zero give numbers that are not finite.
  void run(const double* values, double* numbers) const;
  std::size_t bytes() const;

 private:
  struct Entry {
    int value;
    std::uint32_t target;
    double scale;
  };
  struct Products {
    std::uint32_t target, factor, other, count;
  };
  struct Quotients {
    std::uint32_t target, pivot, count;
  };
  struct Range {
    std::size_t products = 0, quotients = 0;  ///< ends
  };
  /// Of a number, as levels.
  struct Uses {
    int ready = 0;  ///< in which it can be used
    int read = 0;   ///< the last one in which it is needed as it is
  };
  /// Until `finish`. What grows is not moved: for a large matrix that would take most of the time.
  struct Draft {
    std::vector<Uses> uses;  ///< by number
    std::deque<Entry> entries;
    std::deque<Products> products;
    std::deque<Quotients> quotients;
    std::deque<int> level_of_products, level_of_quotients;
  };
  int level_of_targets(std::size_t target, std::size_t count) const;

  std::vector<Entry> entries_;
  std::vector<Products> products_;
  std::vector<Quotients> quotients_;
  std::vector<Range> ends_;
  std::optional<Draft> draft_;
};

}  // namespace mbcosim
