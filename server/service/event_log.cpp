#include "service/event_log.h"

#include <spdlog/spdlog.h>

#include <algorithm>

#include "rpc/call_scope.h"
#include "threads/top_frame.h"

namespace mbcosim::server {

bool Rate::pass(Clock::time_point now, std::int64_t* missed) {
  Guard guard(mutex_);
  if (now - second_ >= std::chrono::seconds(1)) {
    second_ = now;
    passed_ = 0;
  }
  if (passed_ >= per_second_) {
    ++missed_;
    return false;
  }
  ++passed_;
  *missed = std::exchange(missed_, 0);
  return true;
}

std::string printable(std::string text) {
  std::replace_if(
      text.begin(), text.end(),
      [](char c) { return static_cast<unsigned char>(c) < 32 || c == 127; }, '?');
  return text;
}

namespace {

thread_local LogFields fields_of_thread;

const char* text_of(v1::PeerChange change) {
  return change == v1::PEER_CHANGE_ATTACHED ? " attached to port "
         : change == v1::PEER_CHANGE_LEFT   ? " left port "
                                            : " is late at port ";
}

const char* text_of(v1::SnapshotChange change) {
  return change == v1::SNAPSHOT_CHANGE_SAVED      ? " saved"
         : change == v1::SNAPSHOT_CHANGE_RESTORED ? " restored"
                                                  : " deleted";
}

}  // namespace

const LogFields& EventLog::fields() { return fields_of_thread; }

void EventLog::write(Rate& rate, const std::string& text, LogFields fields) {
  std::int64_t missed = 0;
  if (!rate.pass(Rate::Clock::now(), &missed)) return;
  fields_of_thread = std::move(fields);
  if (missed > 0)
    spdlog::info("{} (and {} such lines before it were left out)", printable(text), missed);
  else
    spdlog::info("{}", printable(text));
  fields_of_thread.clear();
}

void EventLog::add(const Subject& subject, v1::Event event) {
  event.set_simulation(subject.name);
  if (const CallLabels* call = CallScope::current()) {
    event.set_identity(call->identity);
    event.set_method(call->method);
    event.set_trace_id(call->trace_id);
  }
  journal_.add(std::move(event), subject.grants.now());
}

void EventLog::refused(const std::string& method, const std::string& identity,
                       const Refusal& refusal) {
  write(refusals_,
        method + " refused to " + (identity.empty() ? "a caller not known" : identity) + ": " +
            reason_name(refusal.reason()) + ": " + refusal.what(),
        {{"reason", reason_name(refusal.reason())}});
}

void EventLog::created(const Subject& subject, const std::string& display_name,
                       const std::string& forked_from) {
  write(lives_, subject.name + " created for " + subject.grants.owner(),
        {{"session", subject.name}});
  v1::Event event;
  event.mutable_created()->set_display_name(display_name);
  event.mutable_created()->set_forked_from(forked_from);
  add(subject, std::move(event));
}

void EventLog::deleted(const Subject& subject, v1::DeletionCause cause) {
  const bool over = cause == v1::DELETION_CAUSE_LEASE_OVER;
  write(lives_, subject.name + (over ? ": lease over" : " deleted"), {{"session", subject.name}});
  v1::Event event;
  event.mutable_deleted()->set_cause(cause);
  add(subject, std::move(event));
}

void EventLog::state_changed(const Subject& subject, v1::SimulationState state, std::int64_t step) {
  constexpr std::size_t kPrefix = sizeof("SIMULATION_STATE_") - 1;
  write(lives_,
        subject.name + " is " + v1::SimulationState_Name(state).substr(kPrefix) + " at step " +
            std::to_string(step),
        {{"session", subject.name}});
  v1::Event event;
  event.mutable_state_changed()->set_state(state);
  event.mutable_state_changed()->set_step(step);
  add(subject, std::move(event));
}

void EventLog::step_failed(const Subject& subject, v1::StepOutcome outcome,
                           const v1::SolverFailure& failure) {
  write(failures_,
        subject.name + ": step " + std::to_string(failure.step()) + " failed: " + failure.message(),
        {{"session", subject.name}, {"reason", reason_name(failure.reason())}});
  v1::Event event;
  event.mutable_step_failed()->set_outcome(outcome);
  *event.mutable_step_failed()->mutable_failure() = failure;
  add(subject, std::move(event));
}

void EventLog::peer(const Subject& subject, v1::PeerChange change, const std::string& port,
                    const std::string& peer, const std::string& why) {
  const std::string who = peer.empty() ? "the peer" : peer;
  write(peers_,
        subject.name + ": " + who + text_of(change) + port + (why.empty() ? "" : ": " + why),
        {{"session", subject.name}, {"port", port}, {"peer", peer}});
  v1::Event event;
  event.mutable_peer()->set_change(change);
  event.mutable_peer()->set_port(port);
  event.mutable_peer()->set_peer(peer);
  add(subject, std::move(event));
}

void EventLog::snapshot(const Subject& subject, v1::SnapshotChange change, const std::string& name,
                        std::int64_t step) {
  write(lives_, name + text_of(change), {{"session", subject.name}});
  v1::Event event;
  event.mutable_snapshot()->set_change(change);
  event.mutable_snapshot()->set_name(name);
  event.mutable_snapshot()->set_step(step);
  add(subject, std::move(event));
}

void EventLog::checkpoint(const Subject& subject, std::int64_t step, std::int64_t bytes) {
  if (spdlog::should_log(spdlog::level::debug))  // many, and each as expected
    write(lives_,
          subject.name + ": checkpoint of step " + std::to_string(step) + ", " +
              std::to_string(bytes) + " bytes",
          {{"session", subject.name}});
  v1::Event event;
  event.mutable_checkpoint()->set_step(step);
  event.mutable_checkpoint()->set_bytes(bytes);
  add(subject, std::move(event));
}

void EventLog::checkpoint_failed(const Subject& subject, const std::string& why) {
  write(failures_, subject.name + ": no checkpoint: " + why, {{"session", subject.name}});
  v1::Event event;
  event.mutable_checkpoint_failed()->set_message(why);
  add(subject, std::move(event));
}

void EventLog::lease_ending(const Subject& subject, double seconds_left) {
  write(lives_,
        subject.name + ": its lease ends in " +
            std::to_string(static_cast<std::int64_t>(seconds_left)) + " s",
        {{"session", subject.name}});
  v1::Event event;
  event.mutable_lease_ending()->set_seconds_left(seconds_left);
  add(subject, std::move(event));
}

}  // namespace mbcosim::server
