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
  if (request.has_step_size_s()) {
    StepChoice choice;
    choice.length = request.step_size_s();
    check_field("step_size_s", choice, simulation);
  }
  if (request.until().has_locate_within_s()) {
    StepChoice choice;
    choice.event = [] { return 0.0; };
    choice.within = request.until().locate_within_s();
    check_field("until.locate_within_s", choice, simulation);
  }
}

bool goes_on(const v1::StepRequest& request, const Simulation& simulation) {
  if (!request.has_until_time_s()) return true;
  const double end = request.until_time_s();
  const double length =
      request.has_step_size_s() ? request.step_size_s() : simulation.next_step_size();
  if (request.exact()) return simulation.next_towards(end, length).has_value();
  return simulation.time() + 0.5 * length <= end;
}

StepChoice next_choice(const v1::StepRequest& request, bool first, const VariableAccess& variables,
                       const Simulation& simulation) {
  StepChoice choice;
  if (request.has_step_size_s()) choice.length = request.step_size_s();
  if (request.exact()) choice = *simulation.next_towards(request.until_time_s(), choice.length);
  const bool beyond = choice.length && *choice.length > simulation.largest_step_size() &&
                      *choice.length != simulation.next_step_size();
  if (!first && beyond)
    if (const auto last = simulation.next_towards(simulation.final_time(), choice.length))
      choice = *last;
  if (request.until().has_locate_within_s()) {
    choice.event = [&] { return variables.distance_behind(request.until(), simulation); };
    choice.within = request.until().locate_within_s();
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
  if (choice.length) step.set_step_size_s(*choice.length);
  if (choice.end) {
    step.set_until_time_s(*choice.end);
    step.set_exact(true);
    step.set_step_size_s(length_of(choice, simulation));
  } else {
    step.set_steps(1);
  }
  if (choice.event) *step.mutable_until() = request.until();
  return step;
}

}  // namespace mbcosim::server
