/// The numbers of a sparse factor, by several threads.
#pragma once

#include <atomic>
#include <vector>

#include "reduction/sparse_factor.h"

namespace mbcosim {

/// Blocks are taken in one order, that of their height in the elimination tree, and each waits for
/// the blocks that reach it: these were taken before. What a block gathers comes in a fixed order.
class Factorization {
 public:
  Factorization(const SparseMatrix& matrix, const FactorSettings& settings, SparseFactor& factor);
  void run();

 private:
  /// Block `from` has the rows top … end − 1 of its own in the block that it reaches.
  struct Reach {
    int from, top, end;
  };
  struct Scratch {
    std::vector<int> local;  ///< of rows, in the block
    std::vector<int> place;  ///< in the block, of the rows of one that reaches it
    std::vector<double> numbers;
    double* room(std::size_t count) {
      if (numbers.size() < count) numbers.resize(count);
      return numbers.data();
    }
  };
  void find_reaches();
  void find_order();
  void tell(double share) const;
  void work(bool tells);
  void compute(int s, Scratch& scratch);
  void load(int s, const std::vector<int>& local);
  void gather(const Reach& reach, int s, Scratch& scratch);

  const SparseMatrix& matrix_;
  const FactorSettings& settings_;
  SparseFactor& factor_;
  const Supernodes& pattern_;
  std::vector<std::size_t> reach_from_;  ///< (blocks + 1), in `reaches_`
  std::vector<Reach> reaches_;           ///< by the block that is reached, `from` ascending
  std::vector<int> order_;
  std::vector<double> operations_;  ///< up to and with the block at a position of `order_`
  std::vector<std::atomic<char>> done_;
  std::atomic<int> next_{0};
  std::atomic<int> end_;  ///< position in `order_` of the first block that cannot be eliminated
  std::atomic<bool> stopped_{false};
};

}  // namespace mbcosim
