/// What the author of a deck can do about a step that did not converge from a sound state.
#pragma once

#include <string>
#include <vector>

#include "model/diagnostic.h"
#include "model/model.h"

namespace mbcosim {

/// The first of these that holds, with its remedy; empty when none does: a body whose inertia does
/// not go with the model's size (units), loads that jump within the step, a node that turns far
/// within it. `before`: state at which the step began; `h`: its length [s].
std::string remedy_by_cause(const Model& model, const State& before, double h);

/// The same by the course of the iteration: it goes to and fro (contact, friction, corners of
/// laws), or was still getting nearer. `history`: residual norms; `worst`: equations at the end.
std::string remedy_by_course(const std::vector<double>& history,
                             const std::vector<WorstEquation>& worst);

}  // namespace mbcosim
