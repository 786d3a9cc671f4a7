/// Eigen's larger decompositions of dense matrices, compiled once: they take the compiler seconds
/// wherever they are instantiated.
#pragma once

#include <Eigen/Eigenvalues>
#include <Eigen/LU>

#include "math/types.h"

extern template class Eigen::PartialPivLU<mbcosim::MatX>;
extern template class Eigen::SelfAdjointEigenSolver<mbcosim::MatX>;
extern template Eigen::SelfAdjointEigenSolver<mbcosim::MatX>&
Eigen::SelfAdjointEigenSolver<mbcosim::MatX>::compute(const Eigen::EigenBase<mbcosim::MatX>&, int);
extern template class Eigen::GeneralizedSelfAdjointEigenSolver<mbcosim::MatX>;
