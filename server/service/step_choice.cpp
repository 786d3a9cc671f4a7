#include "service/step_choice.h"

#include <string>

#include "wire/refusal.h"

namespace mbcosim::server {
namespace {

void check_field(const char* field, const StepChoice& choice, const Simulation& simulation) {
  const auto status = simulation.check(choice);
  if (status) return;
  throw Refusal(v1::REASON_BAD_ARGUMENT, "`" + std::string(field) + "`: " + status.error().message,
                {{"field", field}});
}

}  // namespace

void check_choice(const v1::StepRequest& request, const Simulation& simulation) {
  if (request.has_step_size()) {
    StepChoice choice;
    choice.length = request.step_size();
    check_field("step_size", choice, simulation);
  }
  if (request.until().has_locate_within()) {
    StepChoice choice;
    choice.event = [] { return 0.0; };
    choice.within = request.until().locate_within();
    check_field("until.locate_within", choice, simulation);
  }
}

void check_step(std::int64_t expected, const Simulation& simulation) {
  const std::int64_t step = simulation.step_number();
  if (expected == step) return;
  throw Refusal(v1::REASON_WRONG_STEP,
                "expected step " + std::to_string(expected) + ", the simulation is at step " +
                    std::to_string(step),
                {{"step", std::to_string(step)}});
}

bool goes_on(const v1::StepRequest& request, const Simulation& simulation) {
  if (!request.has_until_time()) return true;
  const double end = request.until_time();
  const double length = request.has_step_size() ? request.step_size() : simulation.next_step_size();
  if (request.exact()) return simulation.next_towards(end, length).has_value();
  return simulation.time() + 0.5 * length <= end;
}

StepChoice next_choice(const v1::StepRequest& request, bool first, const VariableAccess& variables,
                       const Simulation& simulation) {
  StepChoice choice;
  if (request.has_step_size()) choice.length = request.step_size();
  if (request.exact()) choice = *simulation.next_towards(request.until_time(), choice.length);
  const bool beyond = choice.length && *choice.length > simulation.largest_step_size() &&
                      *choice.length != simulation.next_step_size();
  if (!first && beyond)
    if (const auto last = simulation.next_towards(simulation.final_time(), choice.length))
      choice = *last;
  if (request.until().has_locate_within()) {
    choice.event = [&] { return variables.distance_behind(request.until(), simulation); };
    choice.within = request.until().locate_within();
  }
  return choice;
}

bool is_the_decks(const StepChoice& choice) {
  return !choice.length && !choice.end && !choice.event;
}

double length_of(const StepChoice& choice, const Simulation& simulation) {
  if (choice.end) return *choice.end - simulation.time();
  return choice.length ? *choice.length : simulation.next_step_size();
}

v1::StepRequest request_of(const StepChoice& choice, const v1::StepRequest& request,
                           const Simulation& simulation) {
  v1::StepRequest step;
  if (choice.length) step.set_step_size(*choice.length);
  if (choice.end) {
    step.set_until_time(*choice.end);
    step.set_exact(true);
    step.set_step_size(length_of(choice, simulation));
  } else {
    step.set_steps(1);
  }
  if (choice.event) *step.mutable_until() = request.until();
  return step;
}

}  // namespace mbcosim::server
