/// Scaling of a pencil A − s E by powers of ten.
#pragma once

#include "math/types.h"

namespace mbcosim {

/// Factors of rows and columns: L A R and L E R are the scaled matrices.
struct PencilScales {
  VecX rows, columns;
};

/// Factors that bring all entries of A and E that are not zero near 1: the least squares of their
/// logarithms (R. C. Ward, "Balancing the generalized eigenvalue problem", SIAM J. Sci. Stat.
/// Comput. 2, 1981), by as few steps of conjugate gradients as LAPACK's dggbal does, rounded to
/// whole powers.
PencilScales scale_pencil(const MatX& A, const MatX& E);

}  // namespace mbcosim
