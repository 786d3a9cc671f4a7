#include "service/step_news.h"

#include <spdlog/spdlog.h>

#include "service/step_account.h"

namespace mbcosim::server {

void StepNews::inputs(const v1::Values& inputs) {
  if (parts_.recorder && inputs.handles_size() > 0) parts_.recorder->inputs(inputs);
}

void StepNews::chosen(const StepChoice& choice, const v1::StepRequest& request,
                      const Simulation& simulation) {
  if (parts_.recorder && !is_the_decks(choice))
    parts_.recorder->chosen(request_of(choice, request, simulation));
}

bool StepNews::concerns(const StepReport& report) const {
  return parts_.recorder || !parts_.telemetry.empty() || report.error ||
         report.outcome != StepOutcome::accepted;
}

void StepNews::stepped(const StepReport& report, const v1::StepReply& reply,
                       const Simulation& simulation) {
  const bool accepted = is_accepted(report.outcome);
  const std::int64_t step = simulation.step_number();
  if (parts_.recorder) parts_.recorder->stepped(accepted, step, simulation.time());
  parts_.status.publish(simulation);
  if (report.error && report.outcome != StepOutcome::interrupted) {
    parts_.status.remember_failure(reply.failure().message());
    parts_.log.step_failed(parts_.subject, reply.outcome(), reply.failure());
  }
  if (report.outcome == StepOutcome::finished)
    parts_.log.state_changed(parts_.subject, v1::SIMULATION_STATE_FINISHED, step);
  if (accepted && !parts_.telemetry.empty()) parts_.telemetry.publish(simulation);
}

void StepNews::unsolved(const Simulation& simulation) {
  if (parts_.recorder) parts_.recorder->stepped(false, simulation.step_number(), simulation.time());
  parts_.status.publish(simulation);
}

void StepNews::failed(const v1::StepReply& reply, const Simulation& simulation) {
  unsolved(simulation);
  parts_.status.remember_failure(reply.failure().message());
  parts_.log.step_failed(parts_.subject, reply.outcome(), reply.failure());
}

void StepNews::broken(const std::string& what, const std::string& told, std::int64_t step) {
  spdlog::error("{}: {}", parts_.subject.name, what);
  parts_.status.fail(told);
  parts_.log.state_changed(parts_.subject, v1::SIMULATION_STATE_FAILED, step);
}

}  // namespace mbcosim::server
