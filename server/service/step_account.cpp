#include "service/step_account.h"

#include <algorithm>

#include "wire/convert.h"

namespace mbcosim::server {

StepAccount::StepAccount(const v1::StepRequest& request, v1::StepReply& reply)
    : request_(request), reply_(reply) {
  if (request.has_steps()) steps_left_ = request.steps();
  if (request.has_until_time() || (request.has_until() && !request.has_steps()))
    steps_left_ = INT64_MAX;
}

void StepAccount::go_on_from(const std::string& begun) {
  reply_.ParseFromString(begun);
  steps_left_ -= reply_.steps_done();
  ended_ = reply_.condition_met();
}

void StepAccount::begin(bool finished) {
  reply_.set_request_id(request_.request_id());
  reply_.set_outcome(finished ? v1::STEP_OUTCOME_FINISHED : v1::STEP_OUTCOME_ACCEPTED);
}

void StepAccount::enter(const StepReport& report) {
  reply_.set_outcome(to_proto(report.outcome));
  reply_.set_steps_done(reply_.steps_done() + report.steps_done);
  reply_.set_step_size(report.step_size);
  reply_.set_iterations(report.iterations);
  reply_.set_total_iterations(reply_.total_iterations() + report.iterations);
  reply_.set_residual_error(report.residual_error);
  if (report.solution_error != 0) reply_.set_solution_error(report.solution_error);
  reply_.set_solver_seconds(reply_.solver_seconds() + report.solver_seconds);
  ended_ = report.error || !is_accepted(report.outcome);
  if (report.error && report.outcome != StepOutcome::interrupted)
    to_proto(*report.error, reply_.mutable_failure());
  if (!is_accepted(report.outcome)) return;
  --steps_left_;
  reply_.set_flagged(report.flagged);
  reply_.set_pieces(report.pieces);
  if (report.flagged) reply_.set_flagged_steps(reply_.flagged_steps() + 1);
  if (report.pieces > 1) reply_.set_cut_steps(reply_.cut_steps() + 1);
  if (report.restarted) reply_.set_restarted_steps(reply_.restarted_steps() + 1);
}

void StepAccount::enter_delay(double delay) {
  reply_.set_late_steps(reply_.late_steps() + 1);
  reply_.set_worst_delay_seconds(std::max(reply_.worst_delay_seconds(), delay));
}

void StepAccount::enter_wait(double seconds) {
  reply_.set_peer_wait_seconds(reply_.peer_wait_seconds() + seconds);
}

void StepAccount::test_condition(const VariableAccess& variables, const Simulation& simulation) {
  if (!request_.has_until() || !variables.holds(request_.until(), simulation)) return;
  reply_.set_condition_met(true);
  ended_ = true;
}

void StepAccount::end(v1::StepOutcome outcome) {
  ended_ = true;
  reply_.set_outcome(outcome);
}

void StepAccount::fail(v1::StepOutcome outcome, v1::Reason reason, const std::string& why,
                       std::int64_t step, double time) {
  end(outcome);
  v1::SolverFailure* failure = reply_.mutable_failure();
  failure->set_reason(reason);
  failure->set_message(utf8(why));
  failure->set_step(step);
  failure->set_time(time);
}

void StepAccount::finish(const VariableAccess& variables, const Simulation& simulation) {
  reply_.set_next_step_size(simulation.next_step_size());
  reply_.set_largest_step_size(simulation.largest_step_size());
  reply_.set_step(simulation.step_number());
  reply_.set_time(simulation.time());
  variables.read(simulation, request_.outputs(), reply_.mutable_outputs());
  reply_.set_total_seconds(std::chrono::duration<double>(Clock::now() - start_).count());
}

}  // namespace mbcosim::server
