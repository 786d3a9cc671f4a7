/// A rank-revealing look at a matrix that could not be factored: which unknowns nothing determines, which equations fight.
#pragma once

#include <string>
#include <vector>

#include "model/model.h"

namespace mbcosim {

struct Singularity {
  int rank_loss = 0;  ///< n − rank, 0 when not determined
  std::vector<WorstEquation> undetermined;  ///< unknowns with the largest share in the null space
  std::vector<WorstEquation> redundant;     ///< equations with the largest share in the left null space
  std::string text() const;
};

/// Dense LU with full pivoting, for models of up to 2000 unknowns; larger ones are answered by `column`, the column without a
/// pivot that the sparse factorization met (-1: unknown).
Singularity find_singularity(const Model& model, const std::vector<double>& values, int column);

}  // namespace mbcosim
