#include "service/advance.h"

#include "model/check.h"
#include "wire/convert.h"
#include "wire/refusal.h"

namespace mbcosim::server {
namespace {

using Clock = std::chrono::steady_clock;
constexpr auto kSlice =
    std::chrono::milliseconds(5);  // longest hold of lock and slot by many short steps
constexpr auto kJournalSlice = std::chrono::milliseconds(50);  // a write to the disk follows

}  // namespace

Advance::Advance(const Parts& parts, const v1::StepRequest& request, v1::StepReply& reply,
                 KeptReplies::Turn& turn, RowTable* table)
    : parts_(parts),
      request_(request),
      turn_(turn),
      table_(table),
      account_(request, reply),
      pace_(parts.pace),
      news_({parts.subject, parts.shared.log, parts.status, parts.telemetry, parts.recorder}),
      journal_({parts.storage, parts.results, parts.status, news_, parts.shared.memory}, turn,
               account_),
      solver_(parts.shared.memory, token_) {
  if (turn.begun()) account_.go_on_from(*turn.begun());
}

void Advance::run(const Progress& progress) {
  try {
    run_slices(progress);
  } catch (...) {
    break_off();
    throw;
  }
}

bool Advance::run_at_once(SolverSlots::Slot slot) {
  if (!parts_.lock.try_lock()) return false;
  first_slot_.emplace(std::move(slot));
  try {
    const Guard lock(parts_.lock, std::adopt_lock);
    if (!parts_.telemetry.empty()) return false;
    const bool ended = run_slice_held();
    MBCOSIM_CHECK(ended, "one step is one slice");
  } catch (...) {
    break_off();
    throw;
  }
  return true;
}

void Advance::run_slices(const Progress& progress) {
  while (!(is_coupled() ? run_coupled_step() : run_slice())) {
    wait_for_subscribers();
    pace_.wait(token_, progress);
    if (progress) progress();
  }
  pace_.wait(token_, progress);
  while (must_wait()) wait_for_subscribers();
}

bool Advance::is_coupled() const { return parts_.deck_sockets || !parts_.coupler.ports().empty(); }

// What was done stays, and a repeat of the request goes on from there.
void Advance::break_off() {
  const Guard lock(parts_.lock);
  parts_.storage.rest();
  if (account_.reply().steps_done() > 0 && turn_.has_id()) turn_.break_off(account_.reply());
}

// Does a subscriber keep the session waiting?
bool Advance::must_wait() const { return parts_.telemetry.blocked() && !token_.cancelled(); }

// Without lock and slot: nobody else waits for a slow reader.
void Advance::wait_for_subscribers() {
  constexpr std::chrono::milliseconds kLook(20);  // longest wait before looking round
  if (parts_.telemetry.blocked()) parts_.telemetry.wait_for_room(kLook);
}

// ------------------------------------------------------------------ what comes next

// Does once what comes before the first step.
void Advance::begin() {
  if (started_) return;
  const bool goes_on = turn_.begun() != nullptr;
  if (request_.has_expected_step() && !goes_on)
    check_step(request_.expected_step(), parts_.simulation);
  check_choice(request_, parts_.simulation);
  account_.begin(parts_.simulation.finished());
  journal_.begin(parts_.simulation);
  if (!goes_on) {
    parts_.variables.write(request_.inputs(), parts_.simulation);
    parts_.storage.note_change();
    if (request_.inputs().handles_size() > 0) journal_.note();
    if (parts_.recorder || is_coupled()) journal_.settle(parts_.simulation);  // others see them
    news_.inputs(request_.inputs());
  }
  started_ = true;
  parts_.storage.work(turn_, account_.reply());
  pace_.start(parts_.simulation.time());
  if (table_) table_->start(parts_.simulation);
}

bool Advance::wants_more() const {
  return account_.wants_more() && !parts_.simulation.finished() &&
         goes_on(request_, parts_.simulation);
}

// Is there a next step? Its choice is made then.
bool Advance::choose() {
  if (!wants_more() || !may_write()) return false;
  const bool first = account_.reply().steps_done() == 0;
  choice_ = next_choice(request_, first, parts_.variables, parts_.simulation);
  return true;
}

// Can the results of another step be written? Else the advance ends.
bool Advance::may_write() {
  if (!parts_.results) return true;
  const Status ready = parts_.results->ready();
  if (ready) return true;
  const bool limit = ready.error().kind == ErrorKind::limit;
  fail(limit ? v1::STEP_OUTCOME_LIMIT : v1::STEP_OUTCOME_NOT_WRITTEN, reason_of(ready.error().kind),
       ready.error().message);
  return false;
}

// ------------------------------------------------------------------ without ports

// Steps for a while with lock and slot held. True: the advance has ended and the reply is complete.
bool Advance::run_slice() {
  const Guard lock(parts_.lock);
  return run_slice_held();
}

bool Advance::run_slice_held() {
  try {
    return step_and_settle();
  } catch (...) {
    settle_before_failure();
    throw;
  }
}

// What could not be stored is taken back; the call fails for its own reason.
void Advance::settle_before_failure() {
  if (parts_.status.failed()) return;
  try {
    journal_.settle(parts_.simulation);
  } catch (const Refusal&) {
  }
}

bool Advance::step_and_settle() {
  begin();
  if (must_wait()) {
    journal_.settle(parts_.simulation);
    return false;
  }
  if (wants_more() && !step_for_a_while()) {
    journal_.settle(parts_.simulation);
    return false;
  }
  conclude();
  return true;
}

StepSlot Advance::take_slot() {
  if (first_slot_) {
    SolverSlots::Slot slot = std::move(*first_slot_);
    first_slot_.reset();
    return {std::move(slot), parts_.shared.slots, parts_.subject.grants.owner(), token_,
            parts_.shared.metrics};
  }
  return {parts_.shared.slots, parts_.subject.grants.owner(), token_, parts_.shared.metrics};
}

// True: the advance has ended.
bool Advance::step_for_a_while() {
  StepSlot slot = take_slot();
  const bool journaled = parts_.storage.has_journal();
  const Clock::time_point slice_end = Clock::now() + (journaled ? kJournalSlice : kSlice);
  while (choose()) {
    if (!slot || token_.cancelled()) {
      account_.end(v1::STEP_OUTCOME_INTERRUPTED);
      return true;
    }
    const std::optional<StepReport> report = attempt();
    if (report) enter(*report);
    if (report && journaled && news_.concerns(*report)) {
      slot.give_up();  // nobody waits for the disk with a slot
      journal_.settle(parts_.simulation);
      slot.take();
    }
    if (report) tell(*report);
    if (!wants_more()) return true;
    const bool send = table_ && table_->full();
    if (send || must_wait() || pace_.holds() || parts_.lock.contended() ||
        Clock::now() >= slice_end)
      return false;
  }
  return true;
}

// ------------------------------------------------------------------ with ports

// One step with its exchanges. The lock is free while peers compute, except between passes of
// window ports.
bool Advance::run_coupled_step() {
  {
    const Guard lock(parts_.lock);
    begin();
    if (must_wait()) return false;
    if (!choose()) {
      conclude();
      return true;
    }
  }
  CoupledStep step(parts_.coupler, parts_.deck_sockets, token_);
  exchange_and_solve(step);
  const Guard lock(parts_.lock);
  account_.enter_wait(step.waited_seconds());
  parts_.shared.metrics.count_coupled_step(step.waited_seconds(), parts_.coupler.exchanges(),
                                           parts_.coupler.exchange_seconds());
  if (wants_more()) return false;
  conclude();
  return true;
}

void Advance::exchange_and_solve(CoupledStep& step) {
  try {
    step.await_peers();
    {
      const Guard lock(parts_.lock);
      step.prepare(choice_, parts_.simulation);
    }
    step.exchange();
    const Guard lock(parts_.lock);
    solve(step);
  } catch (const PeerLost& lost) {
    lose_peer(step, lost);
  } catch (const PeerRejected& rejected) {
    reject(step, rejected);
  }
}

void Advance::solve(CoupledStep& step) {
  const std::optional<StepReport> report = step.solve(
      parts_.simulation, take_slot(), [this]() TS_REQUIRES(parts_.lock) { return attempt(); });
  if (report) enter(*report);
  const bool accepted = report && is_accepted(report->outcome);
  if (accepted) settle_coupled(step);
  if (report) tell(*report);
  step.tell(accepted, parts_.simulation);
}

// Before peers hear of the step.
void Advance::settle_coupled(CoupledStep& step) {
  if (!parts_.storage.keeping()) return;
  parts_.storage.remember(parts_.coupler.memory());
  try {
    journal_.settle(parts_.simulation);
  } catch (...) {
    step.tell(false, parts_.simulation);
    throw;
  }
}

void Advance::lose_peer(CoupledStep& step, const PeerLost& lost) {
  const Guard lock(parts_.lock);
  step.tell(false, parts_.simulation);
  if (token_.cancelled())
    interrupt();
  else
    fail(v1::STEP_OUTCOME_PEER_LOST, v1::REASON_PEER_LOST, lost.text);
}

void Advance::reject(CoupledStep& step, const PeerRejected& rejected) {
  const Guard lock(parts_.lock);
  step.tell(false, parts_.simulation);
  fail(v1::STEP_OUTCOME_REJECTED_BY_PEER, v1::REASON_REJECTED_BY_PEER, rejected.text);
  if (rejected.preferred) account_.prefer(*rejected.preferred);
}

// ------------------------------------------------------------------ one step

// Nothing: it was not solved, and the reply says so.
std::optional<StepReport> Advance::attempt() {
  news_.chosen(choice_, request_, parts_.simulation);
  try {
    std::optional<StepReport> report = solver_.step(parts_.simulation, choice_, parts_.memory);
    if (parts_.results && report && report->error)
      report->error = parts_.results->without_paths(*report->error);
    if (report) return report;
  } catch (const Refusal&) {
    throw;
  } catch (const std::exception& error) {
    news_.broken(error.what(), "internal error while stepping", parts_.simulation.step_number());
    throw Refusal(v1::REASON_INTERNAL,
                  "internal error while stepping; restore a snapshot or delete the simulation");
  }
  if (token_.cancelled())
    interrupt();
  else
    fail(v1::STEP_OUTCOME_LIMIT, v1::REASON_LIMIT_EXCEEDED, solver_.why_stopped());
  return {};
}

// The step, or its failure, into the reply.
void Advance::enter(const StepReport& report) {
  account_.enter(report);
  if (!is_accepted(report.outcome)) return;
  parts_.storage.note_change();
  journal_.note();
  const double delay = pace_.ended(parts_.simulation.time());
  if (delay > 0) {
    account_.enter_delay(delay);
    parts_.status.count_late_step(delay);
  }
  account_.test_condition(parts_.variables, parts_.simulation);
}

// With JOURNAL the step may be kept from all but the reply until it is on the disk.
void Advance::tell(const StepReport& report) {
  if (table_ && is_accepted(report.outcome)) table_->add(parts_.simulation);
  if (parts_.storage.has_journal() && journal_.has_unsettled()) return;
  news_.stepped(report, account_.reply(), parts_.simulation);
}

// Ends without another step.
void Advance::fail(v1::StepOutcome outcome, v1::Reason reason, const std::string& why) {
  const double end = parts_.simulation.time() + length_of(choice_, parts_.simulation);
  account_.fail(outcome, reason, why, parts_.simulation.step_number() + 1, end);
  end_ = End::failed;
}

void Advance::interrupt() {
  account_.end(v1::STEP_OUTCOME_INTERRUPTED);
  end_ = End::unsolved;
}

// Where the simulation outlives the server, a call that the server's end interrupts is broken off:
// its repeat goes on from there. Rows that were sent cannot be sent again.
void Advance::leave_rest_to_repeat() {
  if (!parts_.server_ends.load() || !parts_.storage.keeping() || !turn_.has_id() || table_ ||
      account_.reply().outcome() != v1::STEP_OUTCOME_INTERRUPTED)
    return;
  journal_.settle(parts_.simulation);
  throw shutting_down();
}

// The reply is complete.
void Advance::conclude() {
  leave_rest_to_repeat();
  if (table_) table_->finish(parts_.simulation);
  account_.finish(parts_.variables, parts_.simulation);
  parts_.storage.rest();
  const bool stored = journal_.has_unsettled();
  journal_.settle(parts_.simulation, /*whole=*/true);
  tell_end();
  turn_.keep(account_.reply(), stored || !parts_.storage.has_journal());
  if (turn_.has_id()) parts_.storage.note_change();
}

void Advance::tell_end() {
  if (end_ == End::unsolved) news_.unsolved(parts_.simulation);
  if (end_ == End::failed) news_.failed(account_.reply(), parts_.simulation);
}

}  // namespace mbcosim::server
