/// Independent references for the motion of mechanisms.
#pragma once

#include <Eigen/Core>
#include <string>

#include "deck_digits.h"
#include "deck_run.h"

namespace mbcosim::reference {

/// Classical Runge–Kutta method of order 4 for ẏ = f(t, y) from t = 0 in `steps` steps.
template <class Vector, class Function>
Vector runge_kutta(Vector y, double end, int steps, Function&& f) {
  const double h = end / steps;
  for (int k = 0; k < steps; ++k) {
    const double t = k * h;
    const Vector k1 = f(t, y), k2 = f(t + h / 2, Vector(y + h / 2 * k1)),
                 k3 = f(t + h / 2, Vector(y + h / 2 * k2)), k4 = f(t + h, Vector(y + h * k3));
    y += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
  }
  return y;
}

/// Richardson extrapolation of a result with an error of the second order in the step: `result(n)`
/// takes n steps.
template <class Function>
auto extrapolated(int steps, Function&& result) {
  const auto coarse = result(steps), fine = result(2 * steps);
  using Value = std::decay_t<decltype(coarse)>;
  return Value(fine + (fine - coarse) / 3);
}

/// Data and initial value blocks of a run to `end` in `steps` steps.
inline std::string problem_block(double end, int steps,
                                 const std::string& more = "method: ms, .6;") {
  return "begin: data; problem: initial value; end: data;\nbegin: initial value; initial time: 0.; "
         "final time: forever; "
         "time step: " +
         digits(end / steps) +
         "; max iterations: 30; tolerance: 1e-9; derivatives tolerance: 1e-2; derivatives "
         "coefficient: 1e-5; " +
         more + " end: initial value;\n";
}

}  // namespace mbcosim::reference
