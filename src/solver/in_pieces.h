/// Dense algorithms on large matrices, cut into pieces of a fraction of a second, between which a
/// token is looked at.
#pragma once

#include <optional>

#include "math/decompositions.h"
#include "math/types.h"
#include "solver/watch.h"

namespace mbcosim {

MatX product(const MatX& a, const MatX& b, const Watch& watch);
MatX transposed_product(const MatX& a, const MatX& b, const Watch& watch);  ///< aᵀ b
MatX solve(const Eigen::PartialPivLU<MatX>& a, const MatX& b, const Watch& watch);

/// Orthonormal basis of the range of `a` (n, n), by a QR factorization with column pivoting; pivots
/// below `tolerance` of the largest count as zero. `Lapack::get` must have succeeded.
MatX range_basis(MatX a, double tolerance, const Watch& watch);

/// A = U T Uᵀ, T quasi-triangular.
struct RealSchurForm {
  MatX t, u;  ///< u only when vectors are wanted
};
/// Nothing when the iteration does not converge.
std::optional<RealSchurForm> real_schur_form(MatX a, bool vectors, const Watch& watch);

Eigen::VectorXcd schur_values(const MatX& t);

/// Eigenvalues and right eigenvectors (columns, 2-norm 1).
struct EigenPairs {
  Eigen::VectorXcd values;
  Eigen::MatrixXcd vectors;
};
EigenPairs schur_pairs(const RealSchurForm& schur, const Watch& watch);
/// Of an upper Hessenberg matrix. Nothing when the iteration does not converge.
std::optional<EigenPairs> hessenberg_pairs(const Eigen::MatrixXcd& h, const Watch& watch);

}  // namespace mbcosim
