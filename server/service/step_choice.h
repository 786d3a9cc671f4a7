/// What a StepRequest asks of each of its steps.
#pragma once

#include "service/variable_access.h"

namespace mbcosim::server {

/// Throws BAD_ARGUMENT with the field's name when no step can be as asked.
void check_choice(const v1::StepRequest& request, const Simulation& simulation);

/// Throws WRONG_STEP when the simulation is at another step.
void check_step(std::int64_t expected, const Simulation& simulation);

/// Is the end that the request names still ahead?
bool goes_on(const v1::StepRequest& request, const Simulation& simulation);

/// The next step of a request that goes on. The first one has been checked; a later one that would
/// go beyond the deck's final time ends there. The choice refers to all arguments.
StepChoice next_choice(const v1::StepRequest& request, bool first, const VariableAccess& variables,
                       const Simulation& simulation);

bool is_the_decks(const StepChoice& choice);
double length_of(const StepChoice& choice, const Simulation& simulation);  ///< [s]

/// The request of this one step, for a replay.
v1::StepRequest request_of(const StepChoice& choice, const v1::StepRequest& request,
                           const Simulation& simulation);

}  // namespace mbcosim::server
