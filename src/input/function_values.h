/// Values and derivatives of the built-in functions of reals.
#pragma once

#include "input/functions.h"
#include "input/program.h"
#include "math/dual.h"

namespace mbcosim {

/// Replaces the arguments, the last of which is at `top`, by the value at the place of the first.
/// Throws EvaluationError outside the domain. Only for pure functions of reals. T: double or a dual
/// number.
template <class T>
void apply(FunctionId id, Slot<T>* first);

/// a ^ b of reals; throws EvaluationError for a < 0 with b ≤ 0.
template <class T>
T power(const T& a, const T& b);

}  // namespace mbcosim
