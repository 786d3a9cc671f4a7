/// The parts of a Newton iteration, one by one, at the state of a simulation.
#pragma once

#include <array>
#include <functional>

#include "simulation/simulation.h"

namespace mbcosim::benchmarks {

/// Processor time of this thread [s]: unlike wall time it does not count other processes.
double thread_time();

/// Median time of one call [s], of calls for at least so many seconds. The shortest would flatter
/// small models: a short call finds a moment in which nobody else uses the caches, a long one never
/// does.
double typical(double seconds, const std::function<void()>& call,
               const std::function<double()>& clock = thread_time);

constexpr int kNewtonParts = 4;
constexpr const char* kNewtonPartNames[kNewtonParts] = {"residual", "matrix", "factor", "solve"};

/// Time of each [s]; nothing when the matrix cannot be factored. `seconds`: spent on each.
/// With several threads it is wall time.
std::optional<std::array<double, kNewtonParts>> newton_parts(const Simulation& simulation,
                                                             double seconds, int threads = 1);

}  // namespace mbcosim::benchmarks
