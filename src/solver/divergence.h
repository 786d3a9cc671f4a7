/// What the author of a deck can do about a step that did not converge from a sound state.
#pragma once

#include <string>
#include <vector>

#include "model/diagnostic.h"
#include "model/model.h"

namespace mbcosim {

/// A body's radius of gyration is of the order of the model's size, unless its inertia is in other
/// units than its mass and the nodes' positions. Empty: no body is strange.
std::string remedy_by_units(const Model& model, const State& state);

/// The first of these that holds, with its remedy; empty when none does: loads that jump within the
/// step, a node that turns far within it. `before`: state at which the step began; `h`: its length
/// [s].
std::string remedy_by_cause(const Model& model, const State& before, double h);

/// Do the residual norms stay bounded and come back to those one or two iterations before?
bool goes_to_and_fro(const std::vector<double>& history);

/// The same by the course of the iteration: it goes to and fro (contact, friction, corners of
/// laws), or was still getting nearer. `history`: residual norms; `worst`: equations at the end;
/// `in_step`: not in the derivatives phase.
std::string remedy_by_course(const std::vector<double>& history,
                             const std::vector<WorstEquation>& worst, bool in_step);

}  // namespace mbcosim
