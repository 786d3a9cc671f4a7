/// Backtracking along the Newton direction. Dennis and Schnabel, "Numerical Methods for
/// Unconstrained Optimization and Nonlinear Equations", algorithm A6.3.1; parameters as in MBDyn's
/// input manual, "line search".
#pragma once

#include "model/settings.h"
#include "solver/newton_system.h"

namespace mbcosim {

/// Moves the iterate along the correction in its scratch (scaled in place to the accepted step) so
/// that ½ rᵀr decreases. False when it gives up: the smallest step is reached without enough
/// decrease (unless the settings accept that), or after too many trials.
bool search_along(NewtonSystem& system, const LineSearchSettings& settings);

}  // namespace mbcosim
