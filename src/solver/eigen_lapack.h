/// Dense generalized eigenproblems by LAPACK's QZ algorithm.
#pragma once

#include "model/diagnostic.h"
#include "model/eigen_report.h"

namespace mbcosim {

/// ErrorKind::not_converged when the QZ iteration fails.
Result<GeneralizedEigen> generalized_eigen(MatX a, MatX b, EigenSettings::Balance balance,
                                           bool vectors);

}  // namespace mbcosim
