/// Forward and backward substitution with a sparse factor, by several threads.
///
///   L x = x,   Lᵀ x = x
///
/// Small subtrees of the elimination tree are independent of each other: each is one task, and what
/// it takes from rows above it is collected apart and subtracted subtree by subtree. The blocks
/// above them follow one after another, large ones in slices. Tasks and slices depend on the factor
/// alone, so that the bits are the same for every number of threads.
#pragma once

#include <vector>

#include "math/thread_team.h"
#include "math/types.h"
#include "reduction/block_kernels.h"
#include "reduction/supernodes.h"

namespace mbcosim {

/// The blocks of a factor by the tasks that substitute them.
class SubstitutionPlan {
 public:
  /// Blocks first … end − 1: the last is the root, whose rows below are all that they reach above.
  struct Subtree {
    int first, end;
  };
  explicit SubstitutionPlan(const Supernodes& pattern);

  const std::vector<Subtree>& subtrees() const { return subtrees_; }
  const std::vector<int>& top() const { return top_; }  ///< the other blocks, ascending

 private:
  std::vector<Subtree> subtrees_;
  std::vector<int> top_;
};

/// One solution: x (unknowns × sides) in the order of elimination.
class Substitution {
 public:
  /// `blocks`: the numbers of each block. `team`: null for one thread.
  Substitution(const Supernodes& pattern, const SubstitutionPlan& plan, const BlockKernels& kernels,
               const std::vector<const double*>& blocks, ThreadTeam* team)
      : pattern_(pattern), plan_(plan), kernels_(kernels), blocks_(blocks), team_(team) {}
  void lower(MatX& x) const;
  void upper(MatX& x) const;

 private:
  void lower_subtree(const SubstitutionPlan::Subtree& subtree, MatX& x, MatX& above) const;
  void lower_block(int s, MatX& x, std::vector<double>& scratch) const;
  void upper_block(int s, MatX& x, std::vector<double>& scratch, ThreadTeam* team) const;
  bool is_shared(int s) const;
  int left(int s) const { return pattern_.height(s) - pattern_.width(s); }
  const int* rows_below(int s) const { return pattern_.rows_of(s) + pattern_.width(s); }

  const Supernodes& pattern_;
  const SubstitutionPlan& plan_;
  const BlockKernels& kernels_;
  const std::vector<const double*>& blocks_;
  ThreadTeam* team_;
};

}  // namespace mbcosim
