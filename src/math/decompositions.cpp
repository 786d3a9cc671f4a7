#include "math/decompositions.h"

template class Eigen::PartialPivLU<mbcosim::MatX>;
template class Eigen::SelfAdjointEigenSolver<mbcosim::MatX>;
template Eigen::SelfAdjointEigenSolver<mbcosim::MatX>&
Eigen::SelfAdjointEigenSolver<mbcosim::MatX>::compute(const Eigen::EigenBase<mbcosim::MatX>&, int);
template class Eigen::GeneralizedSelfAdjointEigenSolver<mbcosim::MatX>;
