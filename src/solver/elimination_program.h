/// The elimination of a small matrix as a list of operations.
#pragma once

#include <cstdint>
#include <vector>

namespace mbcosim {

/// What has to be done with an array of numbers F, for every matrix of one pattern:
///
///   F[target] = value · scale          first
///   F[target] −= F[factor] F[other]    level by level; at the end of a level
///   F[target] /= F[pivot]
///
/// Operations are given in the order in which they would be done one after the other. Levels keep
/// the order of all that touch the same number, so that the results are the same bits. In small
/// matrices it is loops of a few rounds that cost time, not arithmetic; here there are two for each
/// level.
class EliminationProgram {
 public:
  using Place = std::uint16_t;  ///< in F
  static constexpr std::size_t kMostNumbers = 1 << 16;

  /// `numbers`: of F.
  explicit EliminationProgram(std::size_t numbers) : ready_(numbers, 0), read_(numbers, 0) {}
  /// `value`: which of those that `run` gets.
  void set(std::size_t target, int value, double scale);
  void subtract_product(std::size_t target, std::size_t factor, std::size_t other);
  void divide(std::size_t target, std::size_t pivot);
  void finish();  ///< after the last operation

  /// Divisions by zero give numbers that are not finite.
  void run(const double* values, double* numbers) const;
  std::size_t bytes() const;

 private:
  struct Entry {
    int value;
    Place target;
    double scale;
  };
  struct Update {
    Place target, factor, other;
  };
  struct Division {
    Place target, pivot;
  };
  template <class Operation>
  struct Ordered {
    int level;
    Operation operation;
  };
  struct Range {
    std::size_t updates = 0, divisions = 0;  ///< ends
  };

  std::vector<Entry> entries_;
  std::vector<Update> updates_;
  std::vector<Division> divisions_;
  std::vector<Range> ends_;

  // until `finish`
  std::vector<int> ready_;  ///< by number: the level in which it can be used
  std::vector<int> read_;   ///< the last one in which it is needed as it is
  std::vector<Ordered<Update>> ordered_updates_;
  std::vector<Ordered<Division>> ordered_divisions_;
};

}  // namespace mbcosim
