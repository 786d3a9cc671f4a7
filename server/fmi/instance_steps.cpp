/// Steps of an instance: by the engine inside, or by a daemon.
#include <algorithm>
#include <cmath>

#include "fmi/instance.h"
#include "fmi/times.h"

namespace mbcosim::fmi {

Status Instance::check_step(double time, double length) {
  if (!(length > 0) || !std::isfinite(length))
    return fail("the length of a step must be positive, got " + number(length));
  const double tolerance =
      kRounding * std::max({length, std::abs(time), std::abs(communication_time_)});
  if (!(std::abs(time - communication_time_) <= tolerance))
    return fail("the step starts at " + number(time) + " s, the instance stands at " +
                number(communication_time_) + " s");
  if (stop_time_ && time + length > *stop_time_ + tolerance)
    return fail("the step ends after the stop time " + number(*stop_time_) + " s");
  return Status::ok;
}

/// Steps of the deck's length; what is left at the end is a step of its own, which ends at `end`.
/// The length that was taken [s]; less than `length`: there the deck ended the run (`bailout`).
Result<double> Instance::advance(double length, double end) {
  double left = length;
  while (left > kRounding * length) {
    const double h = next_step_size();
    const bool whole = h > 0 && h <= left * (1 + kRounding);
    const auto report = take_step(whole ? std::nullopt : std::optional(end));
    if (!report) return report.error();
    if (report->error) return *report->error;
    if (report->steps_done == 0) return length - left;
    left = whole ? left - report->step_size : 0;
  }
  return length;
}

double Instance::next_step_size() const {
  return ahead_ ? remote_next_size_ : simulation_->next_step_size();
}

/// One step of the deck's length, or one that ends at `end`.
Result<StepReport> Instance::take_step(std::optional<double> end) {
  if (remote_) {
    const auto step = remote_->step(end);
    if (!step) return step.error();
    StepReport report;
    if (step->ended) return report;
    ahead_ = true;
    remote_next_size_ = step->next_size;
    report.steps_done = 1;
    report.step_size = step->size;
    return report;
  }
  if (!end) return simulation_->step();
  StepChoice choice;
  choice.end = *end;
  return simulation_->step(choice);
}

Status Instance::do_step(double time, double length) {
  ended_ = false;
  if (const Status status = check_step(time, length); status != Status::ok) return status;
  if (const auto pulled = pull(); !pulled) return fail(pulled.error().message);
  if (const auto pushed = push(); !pushed) return fail(pushed.error().message);
  const State before = simulation_->snapshot();
  ++revision_;
  const auto taken = advance(length, time + length);
  if (!taken) return failed_step(taken.error(), before);
  if (*taken < length) return end_run(time + *taken);
  communication_time_ = last_time_ = time + length;
  return Status::ok;
}

/// The instance stands at `time`, and further steps end there, too. FMI 2 has fmi2Discard for it,
/// after which it tells the time; in FMI 3 a discarded step has changed nothing and tells nothing.
Status Instance::end_run(double time) {
  communication_time_ = last_time_ = time;
  ended_ = true;
  const std::string message = "the deck ended the run at t = " + number(time) + " s";
  if (standard_ == Standard::fmi2) {
    mode_ = Mode::step_failed;
    return discard(message);
  }
  log_.write(Status::ok, name_ + ": " + message);
  return Status::ok;
}

Status Instance::failed_step(const Error& error, const State& before) {
  (void)simulation_->restore(before);
  ahead_ = false;
  behind_ = true;
  if (error.kind == ErrorKind::peer) return fail(error.message);
  if (standard_ == Standard::fmi2) mode_ = Mode::step_failed;
  return discard(error.message);
}

// ------------------------------------------------------------------ with a daemon

mbcosim::Status Instance::ensure_connected() {
  if (manifest_.remote.empty() || remote_) return ok();
  const double final_time = model_->initial_value.final_time;
  if (stop_time_ && *stop_time_ > final_time + kRounding * std::max(1.0, std::abs(final_time)))
    return make_error(ErrorKind::argument, "",
                      "the stop time " + number(*stop_time_) +
                          " s lies after the deck's final time " + number(final_time) +
                          " s, at which the daemon's simulation ends");
  auto remote = Remote::create(manifest_, files_, {name_, chosen_, model_->digest});
  if (!remote) return remote.error();
  remote_ = std::move(*remote);
  behind_ = true;
  log_.write(Status::ok, "the daemon at " + manifest_.remote + " takes the steps");
  return ok();
}

/// The daemon's state becomes the simulation's.
mbcosim::Status Instance::pull() {
  if (!ahead_) return ok();
  const auto bytes = remote_->state();
  if (!bytes) return bytes.error();
  const auto state = simulation_->state_of(*bytes);
  if (!state) return state.error();
  if (auto restored = simulation_->restore(*state); !restored) return restored;
  ahead_ = false;
  return ok();
}

/// The simulation's state becomes the daemon's.
mbcosim::Status Instance::push() {
  if (auto connected = ensure_connected(); !connected) return connected;
  if (!remote_ || !behind_) return ok();
  const auto gone = remote_->go_to(simulation_->export_state(), simulation_->step_number());
  if (!gone) return gone;
  behind_ = false;
  return ok();
}

}  // namespace mbcosim::fmi
