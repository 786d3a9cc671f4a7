/// The part of Session that advances.
#include "service/session_advance.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <new>
#include <optional>
#include <utility>

#include "service/step_choice.h"
#include "wire/convert.h"
#include "wire/refusal.h"

namespace mbcosim::server {
namespace {

using Clock = std::chrono::steady_clock;
constexpr auto kSlice =
    std::chrono::milliseconds(5);  // longest hold of lock and slot by many short steps
constexpr auto kJournalSlice = std::chrono::milliseconds(50);  // a write to the disk follows

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

}  // namespace

/// Marks the session as advancing while it lives, and connects a token with whoever may interrupt.
class Session::SteppingClaim {
 public:
  SteppingClaim(Session& session, Call& call, CancelToken& token)
      : status_(session.status_), call_(call) {
    if (!status_.claim(&token))
      throw Refusal(v1::REASON_SIMULATION_BUSY,
                    "another call advances the simulation at the moment");
    if (session.lease_.ended()) token.cancel();
    call_.attach(&token);
  }
  ~SteppingClaim() {
    call_.attach(nullptr);
    status_.release();
  }
  SteppingClaim(const SteppingClaim&) = delete;
  SteppingClaim& operator=(const SteppingClaim&) = delete;

 private:
  SessionStatus& status_;
  Call& call_;
};

// ------------------------------------------------------------------ advancing

void Session::step(const v1::StepRequest& request, const Caller& caller, Call& call,
                   v1::StepReply* reply, const Progress& progress, RowTable* table) {
  KeptReplies::Turn turn(kept_, caller, request.request_id(),
                         request.request_id().empty() ? 0 : digest_of("Step", request), call);
  if (turn.known()) {
    reply->ParseFromString(*turn.known());
    return;
  }
  require_usable();
  check(request);
  Advance advance{request, StepAccount(request, *reply), turn, {}, {}, StepPace(pace_), table};
  if (turn.begun()) go_on(advance);
  const SteppingClaim claim(*this, call, advance.token);
  try {
    run(advance, progress);
  } catch (...) {
    break_off(advance);
    throw;
  }
  shared_.metrics.count_advance(*reply, advance.factorizations);
  if (reply->has_failure()) shared_.metrics.count_failure(reply->failure().reason());
}

void Session::run(Advance& advance, const Progress& progress) {
  const bool coupled = deck_sockets_ || !coupler_.ports().empty();
  while (!(coupled ? run_coupled_step(advance) : run_slice(advance))) {
    wait_for_subscribers();
    advance.pace.wait(advance.token, progress);
    if (progress) progress();
  }
  advance.pace.wait(advance.token, progress);
  while (must_wait(advance)) wait_for_subscribers();
}

// The request was begun before: only the rest is done.
void Session::go_on(Advance& advance) {
  advance.account.go_on_from(*advance.turn.begun());
  advance.goes_on = true;
}

// What was done stays, and a repeat of the request goes on from there.
void Session::break_off(Advance& advance) {
  const Guard lock(lock_);
  at_work_ = nullptr;
  const v1::StepReply& reply = advance.account.reply();
  if (reply.steps_done() > 0 && advance.turn.has_id()) advance.turn.break_off(reply);
}

// Does a subscriber keep the session waiting?
bool Session::must_wait(const Advance& advance) const {
  return telemetry_->blocked() && !advance.token.cancelled();
}

// Without lock and slot: nobody else waits for a slow reader.
void Session::wait_for_subscribers() {
  constexpr std::chrono::milliseconds kSlice(20);  // longest wait before looking round
  if (telemetry_->blocked()) telemetry_->wait_for_room(kSlice);
}

bool Session::wants_more(const Advance& advance) const {
  return advance.account.wants_more() && !simulation_->finished() &&
         goes_on(advance.request, *simulation_);
}

// Is there a next step? Its choice is made then.
bool Session::choose(Advance& advance) {
  if (!wants_more(advance) || !may_write(advance)) return false;
  const bool first = advance.account.reply().steps_done() == 0;
  advance.choice = next_choice(advance.request, first, variables_, *simulation_);
  return true;
}

// Can the results of another step be written? Else the advance ends.
bool Session::may_write(Advance& advance) {
  if (!results_) return true;
  const Status ready = results_->ready();
  if (ready) return true;
  const bool limit = ready.error().kind == ErrorKind::limit;
  tell_failure(advance, limit ? v1::STEP_OUTCOME_LIMIT : v1::STEP_OUTCOME_NOT_WRITTEN,
               reason_of(ready.error().kind), ready.error().message);
  return false;
}

// Does once what comes before the first step.
void Session::begin(Advance& advance) {
  if (advance.started) return;
  const v1::StepRequest& request = advance.request;
  if (request.has_expected_step() && !advance.goes_on) check_step(request.expected_step());
  check_choice(request, *simulation_);
  if (journaled()) {
    advance.before_share = MemoryShare(shared_.memory, size_of(simulation_->state()));
    advance.before = simulation_->state();
  }
  if (!advance.goes_on) take_inputs(advance);
  advance.started = true;
  if (keeping_) at_work_ = &advance;
  advance.pace.start(simulation_->time());
  advance.account.begin(simulation_->finished());
  advance.told_before = advance.account.reply();
  if (advance.table) advance.table->start(*simulation_);
}

void Session::take_inputs(Advance& advance) {
  const auto& inputs = advance.request.inputs();
  variables_.write(inputs, *simulation_);
  ++changes_;
  advance.unsettled = inputs.handles_size() > 0;
  if (recorder_ && inputs.handles_size() > 0) recorder_->inputs(inputs);
}

// Steps for a while with lock and slot held. True: the advance has ended and the reply is complete.
bool Session::run_slice(Advance& advance) {
  const Guard lock(lock_);
  begin(advance);
  if (must_wait(advance)) return false;
  if (wants_more(advance) && !step_for_a_while(advance)) {
    settle(advance);
    return false;
  }
  conclude(advance);
  return true;
}

SolverSlots::Slot Session::take_slot(const Advance& advance) {
  const Clock::time_point start = Clock::now();
  SolverSlots::Slot slot = shared_.slots.acquire(identity_.owner, advance.token);
  shared_.metrics.count_slot_wait(seconds_since(start));
  return slot;
}

// True: the advance has ended.
bool Session::step_for_a_while(Advance& advance) {
  std::optional<SolverSlots::Slot> slot(take_slot(advance));
  const Clock::time_point slice_end = Clock::now() + (journaled() ? kJournalSlice : kSlice);
  while (choose(advance)) {
    if (!*slot || advance.token.cancelled()) {
      advance.account.end(v1::STEP_OUTCOME_INTERRUPTED);
      return true;
    }
    const std::optional<StepReport> report = attempt(advance);
    if (report) account(advance, *report);
    if (report && journaled() && is_told_at_once(*report)) {
      slot.reset();  // nobody waits for the disk with a slot
      settle(advance);
      slot.emplace(take_slot(advance));
    }
    if (report) tell(advance, *report);
    if (!wants_more(advance)) return true;
    const bool send = advance.table && advance.table->full();
    if (send || must_wait(advance) || advance.pace.holds() || lock_.contended() ||
        Clock::now() >= slice_end)
      return false;
  }
  return true;
}

// One step. Nothing: it was not solved, and the reply says so.
std::optional<StepReport> Session::attempt(Advance& advance) {
  if (recorder_ && !is_the_decks(advance.choice))
    recorder_->chosen(request_of(advance.choice, advance.request, *simulation_));
  try {
    std::optional<StepReport> report = counted_step(advance);
    if (results_ && report && report->error)
      report->error = results_->without_paths(*report->error);
    return report;
  } catch (const Refusal&) {
    throw;
  } catch (const std::exception& error) {
    spdlog::error("{}: {}", identity_.id, error.what());
    status_.fail("internal error while stepping");
    shared_.log.state_changed(subject(), v1::SIMULATION_STATE_FAILED, simulation_->step_number());
    throw Refusal(v1::REASON_INTERNAL,
                  "internal error while stepping; restore a snapshot or delete the simulation");
  }
}

// A step whose factorizations stay within the budget, and can be stopped where they allocate. When
// they cannot, the state is that before the step.
std::optional<StepReport> Session::counted_step(Advance& advance) {
  MemoryScope scope(shared_.memory, &advance.token);
  std::optional<Result<StepReport>> report;
  const std::int64_t factored = simulation_->factorizations();
  try {
    report = simulation_->step(advance.choice, &advance.token);
  } catch (const std::bad_alloc&) {  // `scope` knows why
  }
  scope.leave();
  advance.factorizations += simulation_->factorizations() - factored;
  const auto factor_bytes = static_cast<std::int64_t>(simulation_->factor_bytes());
  memory_.change(factor_bytes - std::exchange(factor_bytes_, factor_bytes));
  if (report && !*report) throw Refusal(report->error());
  if (report && (!scope.refused() || (*report)->steps_done > 0)) return std::move(**report);
  end_without_memory(advance, scope);
  return {};
}

void Session::end_without_memory(Advance& advance, const MemoryScope& scope) {
  if (advance.token.cancelled()) return end_unsolved(advance, v1::STEP_OUTCOME_INTERRUPTED);
  std::string why = "the server is out of memory";
  try {
    scope.check();
  } catch (const Refusal& refusal) {
    why = refusal.what();
  }
  tell_failure(advance, v1::STEP_OUTCOME_LIMIT, v1::REASON_LIMIT_EXCEEDED, why);
}

void Session::account(Advance& advance, const StepReport& report) {
  advance.account.enter(report);
  if (!is_accepted(report.outcome)) return;
  ++changes_;
  advance.unsettled = true;
  const double delay = advance.pace.ended(simulation_->time());
  if (delay > 0) {
    advance.account.enter_delay(delay);
    status_.count_late_step(delay);
  }
  advance.account.test_condition(variables_, *simulation_);
}

// Tells of one step, or of its failure. With JOURNAL the step may be kept from all but the reply
// until it is on the disk.
void Session::tell(Advance& advance, const StepReport& report) {
  if (advance.table && is_accepted(report.outcome)) advance.table->add(*simulation_);
  if (journaled() && advance.unsettled) return;
  if (recorder_)
    recorder_->stepped(is_accepted(report.outcome), simulation_->step_number(),
                       simulation_->time());
  status_.publish(*simulation_);
  const v1::StepReply& reply = advance.account.reply();
  if (report.error && report.outcome != StepOutcome::interrupted) {
    status_.remember_failure(reply.failure().message());
    shared_.log.step_failed(subject(), reply.outcome(), reply.failure());
  }
  if (report.outcome == StepOutcome::finished)
    shared_.log.state_changed(subject(), v1::SIMULATION_STATE_FINISHED, simulation_->step_number());
  if (is_accepted(report.outcome) && !telemetry_->empty()) telemetry_->publish(*simulation_);
}

// The reply is complete.
void Session::conclude(Advance& advance) {
  if (advance.table) advance.table->finish(*simulation_);
  advance.account.finish(variables_, *simulation_);
  at_work_ = nullptr;
  const bool stored = advance.unsettled;
  settle(advance, /*whole=*/true);
  advance.turn.keep(advance.account.reply(), stored || !journaled());
  if (advance.turn.has_id()) ++changes_;
}

// ------------------------------------------------------------------ with ports

// One step with its exchanges. The session's lock is free while peers compute, except between
// passes of window ports.
bool Session::run_coupled_step(Advance& advance) {
  {
    const Guard lock(lock_);
    begin(advance);
    if (must_wait(advance)) return false;
    if (!choose(advance)) {
      conclude(advance);
      return true;
    }
  }
  coupler_.start_clock();
  if (deck_sockets_) deck_sockets_->start_clock();
  try {
    coupler_.await_peers(advance.token);
    {
      const Guard lock(lock_);
      coupler_.prepare(*simulation_, length_of(advance.choice, *simulation_),
                       bool(advance.choice.event));
    }
    coupler_.exchange(advance.token);
    const Guard lock(lock_);
    step_coupled(advance);
  } catch (const PeerLost& lost) {
    coupler_.notify(false, *simulation_);
    lose_peer(advance, lost.text);
  } catch (const PeerRejected& rejected) {
    coupler_.notify(false, *simulation_);
    reject_step(advance, rejected);
  }
  const Guard lock(lock_);
  advance.account.enter_wait(waited_seconds());
  shared_.metrics.count_coupled_step(waited_seconds(), coupler_.exchanges(),
                                     coupler_.exchange_seconds());
  if (wants_more(advance)) return false;
  conclude(advance);
  return true;
}

/// For peers and codes, since the step began.
double Session::waited_seconds() const {
  return coupler_.waited_seconds() + (deck_sockets_ ? deck_sockets_->waited_seconds() : 0);
}

void Session::step_coupled(Advance& advance) {
  coupler_.apply(*simulation_);
  coupler_.start_iterations(*simulation_);
  const std::optional<StepReport> report = attempt_in_slot(advance);
  if (report) account(advance, *report);
  const bool accepted = report && is_accepted(report->outcome);
  settle_coupled(advance, accepted);
  if (report) tell(advance, *report);
  coupler_.notify(accepted, *simulation_);
  if (accepted) coupler_.finish(*simulation_);
  if (accepted && deck_sockets_) deck_sockets_->accepted(advance.token);
}

// Before peers hear of the step.
void Session::settle_coupled(Advance& advance, bool accepted) {
  if (!keeping_ || !accepted) return;
  peer_memory_ = coupler_.memory();
  try {
    settle(advance);
  } catch (...) {
    coupler_.notify(false, *simulation_);
    throw;
  }
}

/// While it lives, steps exchange with tight ports and the codes at the deck's sockets at each
/// iteration and are redone until window ports agree; the slot is free while others compute.
class Session::ExchangeInStep {
 public:
  using Slot = std::optional<SolverSlots::Slot>;
  ExchangeInStep(Session& session, Advance& advance, Slot& slot)
      : session_(session), advance_(advance), slot_(slot) {
    if (coupler().has_tight() || sockets()) iterate();
    if (coupler().has_window()) repeat();
  }
  ~ExchangeInStep() {
    simulation().set_exchange({});
    simulation().set_attempt_ended({});
    simulation().set_passes({});
  }
  ExchangeInStep(const ExchangeInStep&) = delete;
  ExchangeInStep& operator=(const ExchangeInStep&) = delete;

  /// A new step, or another attempt at it. Throws PeerLost.
  void begin() {
    if (sockets())
      (void)wait([&] {
        sockets()->begin(advance_.token);
        return true;
      });
  }

 private:
  Coupler& coupler() { return session_.coupler_; }
  DeckSockets* sockets() TS_NO_THREAD_SAFETY_ANALYSIS { return session_.deck_sockets_.get(); }
  /// The lock is held: by the step, and while the peer computes by nobody else.
  Simulation& simulation() TS_NO_THREAD_SAFETY_ANALYSIS { return *session_.simulation_; }
  void iterate() {
    simulation().set_attempt_ended([this](bool accepted) {
      const MemoryPause uncounted;
      coupler().end_attempt(accepted, simulation());
      if (sockets()) sockets()->attempt_failed();
    });
    simulation().set_exchange([this](int iteration) {
      return wait([&] {
        const bool done = !sockets() || sockets()->exchange(iteration, advance_.token);
        return coupler().exchange_iteration(simulation(), iteration, advance_.token) && done;
      });
    });
  }
  void repeat() {
    StepPasses passes;
    passes.most = coupler().maximum_passes();
    passes.begin = [this](int pass) {
      const MemoryPause uncounted;
      if (pass == 1) coupler().start_passes(simulation(), std::exchange(agreed_, false));
      coupler().apply_window(simulation());
      if (pass > 1) coupler().start_iterations(simulation());
    };
    passes.agrees = [this](int pass) {
      return agreed_ = wait(
                 [&] { return coupler().exchange_window(simulation(), pass, advance_.token); });
    };
    simulation().set_passes(std::move(passes));
  }
  /// Without the slot.
  template <class Exchange>
  bool wait(Exchange&& exchange) {
    const MemoryPause uncounted;
    slot_.reset();
    const bool done = exchange();
    slot_.emplace(session_.take_slot(advance_));
    return done;
  }

  Session& session_;
  Advance& advance_;
  Slot& slot_;
  bool agreed_ = false;  ///< the interfaces, in the last pass
};

std::optional<StepReport> Session::attempt_in_slot(Advance& advance) {
  std::optional<SolverSlots::Slot> slot(take_slot(advance));
  ExchangeInStep exchange(*this, advance, slot);
  exchange.begin();
  if (*slot) {
    const double waited = waited_seconds();
    std::optional<StepReport> report = attempt(advance);
    if (report) report->solver_seconds -= waited_seconds() - waited;
    return report;
  }
  StepReport report;
  report.outcome = StepOutcome::interrupted;
  return report;
}

void Session::lose_peer(Advance& advance, const std::string& why) {
  const Guard lock(lock_);
  if (advance.token.cancelled())
    end_unsolved(advance, v1::STEP_OUTCOME_INTERRUPTED);
  else
    tell_failure(advance, v1::STEP_OUTCOME_PEER_LOST, v1::REASON_PEER_LOST, why);
}

void Session::reject_step(Advance& advance, const PeerRejected& rejected) {
  const Guard lock(lock_);
  tell_failure(advance, v1::STEP_OUTCOME_REJECTED_BY_PEER, v1::REASON_REJECTED_BY_PEER,
               rejected.text);
  if (rejected.preferred) advance.account.prefer(*rejected.preferred);
}

void Session::end_unsolved(Advance& advance, v1::StepOutcome outcome) {
  tell_unsolved();
  advance.account.end(outcome);
}

void Session::tell_failure(Advance& advance, v1::StepOutcome outcome, v1::Reason reason,
                           const std::string& why) {
  tell_unsolved();
  advance.account.fail(outcome, reason, why, simulation_->step_number() + 1,
                       simulation_->time() + length_of(advance.choice, *simulation_));
  const v1::SolverFailure& failure = advance.account.reply().failure();
  status_.remember_failure(failure.message());
  shared_.log.step_failed(subject(), outcome, failure);
}

void Session::tell_unsolved() {
  if (recorder_) recorder_->stepped(false, simulation_->step_number(), simulation_->time());
  status_.publish(*simulation_);
}

}  // namespace mbcosim::server
