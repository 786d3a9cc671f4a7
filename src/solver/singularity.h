/// A rank-revealing look at a matrix that could not be factored, or with which the iteration did
/// not converge: which unknowns nothing determines, which equations follow from others.
#pragma once

#include <string>
#include <vector>

#include "model/model.h"
#include "solver/watch.h"

namespace mbcosim {

struct Singularity {
  int rank_loss = 0;                        ///< 0 when the matrix has full rank
  std::vector<WorstEquation> undetermined;  ///< unknowns with the largest share in the null space
  std::vector<WorstEquation>
      redundant;                ///< equations with the largest share in the left null space
  bool massless = false;        ///< undetermined are nodes that have bodies: without inertia
  std::string text() const;     ///< "the matrix is singular" and the details
  std::string details() const;  ///< rank loss, unknowns, equations, the remedy
  std::string remedy() const;   ///< what the author of the deck can do
};

/// The card that lets a redundant constraint pass. Not `tikhonov`: with the sign of most rows it
/// drives the joint away. The shares of redundant multipliers wander; an undamped method lets them
/// grow.
inline constexpr const char* kRegularization =
    "in Newton's matrix alone, which leaves the motion exact: `joint regularization: <label>, "
    "jacobian, 1e-12;` with a method that damps, as `method: ms, .6;` (a smaller number where the "
    "iteration does not converge)";

/// Rank to rounding; `column` is the column without a pivot that the sparse factorization met (-1:
/// unknown). Throws Stopped.
Singularity find_singularity(const Model& model, const std::vector<double>& values, int column,
                             const Watch& watch);

/// Rank of a matrix that could be factored, with a looser threshold; full rank for models of more
/// than 400 unknowns, for which the look would take long.
Singularity find_near_singularity(const Model& model, const std::vector<double>& values);

/// The rows where |share| is large, at most `count`, named.
std::vector<WorstEquation> owners_of(const Model& model, const VecX& share, int count);
/// "owner, equation; …".
std::string joined(const std::vector<WorstEquation>& list);

}  // namespace mbcosim
