#include "service/session.h"

#include <google/protobuf/util/time_util.h>

#include <algorithm>
#include <cmath>

#include "model/model_part.h"
#include "service/display_name.h"
#include "service/model_description.h"
#include "service/step_choice.h"
#include "wire/convert.h"
#include "wire/protocol.h"
#include "wire/refusal.h"

namespace mbcosim::server {

namespace {

double rate_of(const v1::CreateOptions& options) {
  if (!options.has_pace()) return 0;
  const double rate = options.pace().rate();
  if (!(rate > 0) || std::isinf(rate))
    throw Refusal(v1::REASON_BAD_ARGUMENT,
                  "`pace.rate` must be a finite number above 0, got " + std::to_string(rate));
  return rate;
}

/// `minimum_step_size` of options or of a change, when it is there.
template <class Message>
std::optional<double> minimum_in(const Message& message) {
  if (!message.has_minimum_step_size()) return {};
  return message.minimum_step_size();
}

}  // namespace

Session::Session(Identity identity, Origin origin, std::unique_ptr<Simulation> simulation,
                 Shared shared, const v1::CreateOptions& options,
                 std::unique_ptr<SessionResults> results, std::unique_ptr<DeckSockets> deck_sockets)
    : identity_(std::move(identity)),
      shared_(shared),
      model_(&simulation->model()),
      variables_(simulation->variables()),
      pace_(rate_of(options)),
      memory_(*simulation),
      origin_(std::move(origin)),
      grants_(identity_.owner, options.grants()),
      lease_(identity_.lease),
      snapshots_(identity_.id, digest_text(model_->digest), shared.limits, shared.memory),
      kept_(shared.memory),
      telemetry_(std::make_shared<TelemetryHub>(shared.memory, shared.lanes, shared.timer,
                                                &shared.metrics)),
      analysis_(*model_, variables_, shared.memory),
      results_(std::move(results)),
      storage_({results_.get(), kept_, shared.memory, shared.metrics},
               [this](const Simulation& now, v1::SimulationInfo* out) { fill_stored(now, out); }),
      simulation_(std::move(simulation)),
      deck_sockets_(std::move(deck_sockets)),
      recorder_(options.record_ports()
                    ? std::make_unique<Recorder>(shared.limits.record_bytes, shared.memory)
                    : nullptr),
      coupler_(options.ports(), *simulation_, identity_.lease, recorder_.get(),
               deck_sockets_ ? DeckSockets::ports(*model_) : std::set<std::string>{},
               options.optional_ports()) {
  check_grants(options.grants());
  status_.set_display_name(identity_.display_name);
  set_policy(policy_of(options.non_convergence_policy(), minimum_in(options)));
  status_.publish(*simulation_);
  if (recorder_) start_record(options);
  if (results_) results_->keep();
  for (const auto& port : coupler_.ports())
    port->set_on_missed([this, name = port->model().name()](const std::string& why) {
      shared_.log.peer(subject(), v1::PEER_CHANGE_LATE, name, "", why);
    });
}

void Session::start_record(const v1::CreateOptions& options) {
  v1::RecordEntry entry;
  v1::RecordHeader* header = entry.mutable_header();
  header->set_protocol_version(kProtocolVersion);
  header->set_model_digest(digest_text(model_->digest));
  header->set_step(simulation_->step_number());
  header->set_time(simulation_->time());
  *header->mutable_ports() = options.ports();
  header->set_summed_time(origin_.time_keeping == TimeKeeping::summed);
  *header->mutable_symbols() = origin_.given;
  if (const UnitSystem* units = find_part<UnitSystem>(*model_))
    to_proto(*units, header->mutable_units());
  if (simulation_->step_number() > 0) header->set_state(simulation_->export_state());
  for (const auto& port : coupler_.ports()) *header->add_layouts() = port->model().layout();
  header->set_non_convergence_policy(to_proto(simulation_->policy()));
  if (simulation_->policy().minimum > 0)
    header->set_minimum_step_size(simulation_->policy().minimum);
  recorder_->add(entry);
}

// ------------------------------------------------------------------ choices

StepPolicy Session::policy_of(v1::NonConvergencePolicy kind, std::optional<double> minimum) {
  if (!v1::NonConvergencePolicy_IsValid(kind))
    throw Refusal(v1::REASON_BAD_ARGUMENT, "`non_convergence_policy` is unknown to this server");
  if (minimum && (!(*minimum > 0) || std::isinf(*minimum)))
    throw Refusal(
        v1::REASON_BAD_ARGUMENT,
        "`minimum_step_size` must be a positive finite number, got " + std::to_string(*minimum));
  StepPolicy policy;
  policy.kind = kind == v1::NON_CONVERGENCE_POLICY_CUT_STEP         ? StepPolicy::cut
                : kind == v1::NON_CONVERGENCE_POLICY_ACCEPT_FLAGGED ? StepPolicy::accept
                                                                    : StepPolicy::fail;
  policy.minimum = minimum.value_or(0);
  return policy;
}

void Session::set_policy(const StepPolicy& policy) {
  simulation_->set_policy(policy);
  status_.set_policy(policy);
}

StepPolicy Session::changed_policy(const v1::UpdateSimulationRequest& request) const {
  const StepPolicy now = simulation_->policy();
  if (!request.has_non_convergence_policy() && !request.has_minimum_step_size()) return now;
  std::optional<double> minimum = minimum_in(request);
  if (!minimum && now.minimum > 0) minimum = now.minimum;
  return policy_of(
      request.has_non_convergence_policy() ? request.non_convergence_policy() : to_proto(now),
      minimum);
}

void Session::update(const v1::UpdateSimulationRequest& request, const Change& change,
                     v1::UpdateSimulationReply* reply) {
  if (request.has_grants() && !grants_.allow(change.caller, Access::own))
    throw Refusal(v1::REASON_NOT_GRANTED, "only the owner and admins change `grants`",
                  {{"wanted", "own"}});
  check_display_name(request.display_name());  // before anything changes
  if (request.has_grants()) check_grants(request.grants().grants());
  const CallGuard lock(lock_, change.call);
  Draft draft{status_.view(), request.has_grants() ? request.grants().grants() : grants_.list()};
  draft.view.policy = changed_policy(request);
  if (request.has_display_name()) draft.view.display_name = request.display_name();
  fill(draft.view, reply->mutable_simulation());
  if (grants_.allow(change.caller, Access::own))
    *reply->mutable_simulation()->mutable_grants() = draft.grants;
  storage_.note_change();
  {
    const DraftInUse in_use(draft_, draft);
    if (status_.failed())
      put_on_disk(capture_change(), change, *reply);
    else
      storage_.store_change(*simulation_, change.turn, *reply);
  }
  set_policy(draft.view.policy);
  grants_.replace(draft.grants);
  status_.set_display_name(draft.view.display_name);
}

void Session::check_grants(const Grants::List& grants) const {
  Grants::check(grants);
  for (const v1::Grant& grant : grants)
    for (const std::string& port : grant.ports())
      if (!coupler_.find(port))
        throw Refusal(v1::REASON_BAD_ARGUMENT,
                      "`grants.ports`: no port is named \"" + port.substr(0, 100) + "\"");
}

const Recorder& Session::record() const {
  if (!recorder_)
    throw Refusal(v1::REASON_NOT_RECORDING, "the simulation was created without `record_ports`");
  return *recorder_;
}

// ------------------------------------------------------------------ telling

void Session::fill(v1::SimulationInfo* out, const Caller& caller) const {
  fill(out);
  if (grants_.allow(caller, Access::own)) *out->mutable_grants() = grants_.list();
}

namespace {

v1::SimulationState phase_of(const SessionStatus::View& view) {
  return view.failed     ? v1::SIMULATION_STATE_FAILED
         : view.stepping ? v1::SIMULATION_STATE_STEPPING
         : view.finished ? v1::SIMULATION_STATE_FINISHED
                         : v1::SIMULATION_STATE_READY;
}

}  // namespace

v1::SimulationState Session::phase() const { return phase_of(status_.view()); }

void Session::fill(v1::SimulationInfo* out) const { fill(status_.view(), out); }

void Session::fill(const SessionStatus::View& p, v1::SimulationInfo* out) const {
  out->set_name(identity_.id);
  out->set_display_name(p.display_name);
  *out->mutable_create_time() =
      google::protobuf::util::TimeUtil::MicrosecondsToTimestamp(identity_.created);
  if (const UnitSystem* units = find_part<UnitSystem>(*model_))
    to_proto(*units, out->mutable_units());
  out->set_non_convergence_policy(to_proto(p.policy));
  if (p.policy.minimum > 0) out->set_minimum_step_size(p.policy.minimum);
  if (pace_ > 0) out->mutable_pace()->set_rate(pace_);
  out->set_late_steps(p.late_steps);
  out->set_worst_delay_seconds(p.worst_delay);
  out->set_owner(identity_.owner);
  out->set_durability(!storage_.keeping()      ? v1::DURABILITY_NONE
                      : storage_.has_journal() ? v1::DURABILITY_JOURNAL
                                               : v1::DURABILITY_CHECKPOINT);
  out->set_state(phase_of(p));
  out->set_step(p.step);
  out->set_time(p.time);
  out->set_next_step_size(p.next_step);
  out->set_model_digest(digest_text(model_->digest));
  out->set_final_time(model_->initial_value.final_time);
  *out->mutable_lease() =
      google::protobuf::util::TimeUtil::MillisecondsToDuration(identity_.lease.count());
  out->set_last_failure(p.last_failure);
  std::string text;
  for (v1::PortWait& wait : coupler_.waits()) {
    char since[64];
    std::snprintf(since, sizeof since, " since %.1f s", wait.seconds());
    text += (text.empty() ? "port " : ", port ") + wait.port() + since;
    *out->add_waits() = std::move(wait);
  }
  const std::string subscribers = telemetry_->waiting_for();
  if (!subscribers.empty()) text += (text.empty() ? "" : ", ") + subscribers;
  out->set_waiting_for(text);
}

void Session::describe(const v1::DescribeSimulationRequest& request,
                       v1::DescribeSimulationReply* reply) const {
  mbcosim::server::describe({*model_, variables(), origin_.symbols, coupler_.ports()}, request,
                            reply);
}

Port& Session::port(const std::string& name) const {
  if (Port* found = coupler_.find(name)) return *found;
  if (deck_sockets_ && DeckSockets::ports(*model_).count(name) > 0)
    throw Refusal(v1::REASON_PORT_TAKEN,
                  "port \"" + name + "\": the code at the socket that the deck names has it");
  throw Refusal(v1::REASON_NO_SUCH_PORT,
                identity_.id + " has no port named \"" + name.substr(0, 100) + "\"");
}

int Session::find_variable(const std::string& name) const {
  return simulation_->find_variable(name);
}

void Session::require_way_back() const {
  if (deck_sockets_)
    throw Refusal(v1::REASON_DECK_SOCKETS,
                  "the codes at the sockets that the deck names cannot go back");
}

Refusal Session::gone() const {
  if (server_ends_.load()) return shutting_down();
  return Refusal(v1::REASON_NO_SUCH_SIMULATION, identity_.id + " was deleted or its lease is over");
}

void Session::require_there() const {
  if (lease_.ended()) throw gone();
}

void Session::require_usable() const {
  require_there();
  if (status_.failed())
    throw Refusal(v1::REASON_SIMULATION_FAILED,
                  "the simulation has failed; restore a snapshot or delete it");
}

// ------------------------------------------------------------------ checks

void Session::check(const v1::StepRequest& request) const {
  if (request.has_steps() && request.steps() < 0)
    throw Refusal(v1::REASON_BAD_ARGUMENT,
                  "`steps` must not be negative, got " + std::to_string(request.steps()));
  if (request.has_until_time() && std::isnan(request.until_time()))
    throw Refusal(v1::REASON_BAD_ARGUMENT, "`until_time` is not a number");
  if (request.exact() && !request.has_until_time())
    throw Refusal(v1::REASON_BAD_ARGUMENT, "`exact` belongs to `until_time`, which is missing");
  if (request.exact() && std::isinf(request.until_time()))
    throw Refusal(v1::REASON_BAD_ARGUMENT, "`until_time` must be finite with `exact`");
  if (request.has_until()) variables_.check_condition(request.until());
  if (request.until().has_locate_within()) require_way_back();
  variables_.check(request.outputs());
  variables_.check_inputs(request.inputs(), "inputs");
}

// ------------------------------------------------------------------ advancing

namespace {

/// Marks the session as advancing while it lives, and connects a token with whoever may interrupt.
class SteppingClaim {
 public:
  SteppingClaim(SessionStatus& status, const Lease& lease, Call& call, CancelToken& token)
      : status_(status), call_(call) {
    if (!status_.claim(&token))
      throw Refusal(v1::REASON_SIMULATION_BUSY,
                    "another call advances the simulation at the moment");
    if (lease.ended()) token.cancel();
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

}  // namespace

// Names them alone; the lock is taken by who uses them.
Advance::Parts Session::advance_parts() {
  return {.subject = subject(),
          .shared = shared_,
          .lock = lock_,
          .simulation = *simulation_,
          .memory = memory_,
          .variables = variables_,
          .status = status_,
          .telemetry = *telemetry_,
          .storage = storage_,
          .coupler = coupler_,
          .results = results_.get(),
          .deck_sockets = deck_sockets_.get(),
          .recorder = recorder_.get(),
          .pace = pace_,
          .server_ends = server_ends_};
}

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
  Advance advance(advance_parts(), request, *reply, turn, table);
  const SteppingClaim claim(status_, lease_, call, advance.token());
  require_usable();  // still
  advance.run(progress);
  count(advance, *reply);
}

namespace {

/// One step that took no longer than to wake a thread for it, and with all its iterations would not
/// have taken long either?
bool was_quick(const v1::StepReply& reply, double quick, int most_iterations) {
  constexpr double kLongest = 100;  // times as long
  const double each = reply.total_seconds() / std::max(1, reply.iterations());
  return !reply.has_failure() && reply.steps_done() == 1 && reply.total_seconds() <= quick &&
         each * most_iterations <= kLongest * quick;
}

/// Is it solved once? What is cut, or shortened by the deck, may be solved often.
bool is_one_step(const v1::StepRequest& request, const StepPolicy& policy, const Model& model) {
  return !request.has_until_time() && !request.has_until() && request.steps() <= 1 &&
         policy.kind != StepPolicy::cut && model.initial_value.strategy == StepStrategy::no_change;
}

}  // namespace

void Session::count(const Advance& advance, const v1::StepReply& reply) {
  shared_.metrics.count_advance(reply, advance.factorizations());
  if (reply.has_failure()) shared_.metrics.count_failure(reply.failure().reason());
  is_quick_ = never_waits() &&
              was_quick(reply, shared_.limits.quick_step, model_->initial_value.max_iterations);
}

// For a disk, a clock or a code?
bool Session::never_waits() const {
  return coupler_.ports().empty() && !deck_sockets_ && !results_ && !storage_.has_journal() &&
         pace_ == 0;
}

bool Session::step_at_once(const v1::StepRequest& request, const Caller& caller, Call& call,
                           v1::StepReply* reply) {
  if (!is_quick() || !is_one_step(request, status_.policy(), *model_)) return false;
  if (!shared_.lanes.at_once().try_lock()) return false;
  const Guard alone(shared_.lanes.at_once(), std::adopt_lock);
  SolverSlots::Slot slot = shared_.slots.try_acquire(identity_.owner);
  if (!slot) return false;
  KeptReplies::Turn turn(kept_, caller, request.request_id(),
                         request.request_id().empty() ? 0 : digest_of("Step", request), call,
                         /*of_state=*/true, KeptReplies::Repeat::leaves);
  if (turn.must_wait() || turn.begun()) return false;
  if (turn.known()) return reply->ParseFromString(*turn.known());
  require_usable();
  check(request);
  Advance advance(advance_parts(), request, *reply, turn);
  const SteppingClaim claim(status_, lease_, call, advance.token());
  require_usable();  // still
  if (!advance.run_at_once(std::move(slot))) return false;
  count(advance, *reply);
  return true;
}

bool Session::interrupt() { return status_.interrupt(); }

// ------------------------------------------------------------------ reading and writing

void Session::read(const v1::ReadVariablesRequest& request, const Call& call,
                   v1::ReadVariablesReply* reply) {
  require_usable();
  variables_.check(request.handles());
  const CallGuard lock(lock_, call);
  read_held(request, reply);
}

bool Session::read_at_once(const v1::ReadVariablesRequest& request, v1::ReadVariablesReply* reply) {
  if (!shared_.lanes.at_once().try_lock()) return false;
  const Guard alone(shared_.lanes.at_once(), std::adopt_lock);
  require_usable();
  variables_.check(request.handles());
  if (!lock_.try_lock()) return false;
  const Guard lock(lock_, std::adopt_lock);
  read_held(request, reply);
  return true;
}

void Session::read_held(const v1::ReadVariablesRequest& request,
                        v1::ReadVariablesReply* reply) const {
  reply->set_step(simulation_->step_number());
  reply->set_time(simulation_->time());
  variables_.read(*simulation_, request.handles(), reply->mutable_values());
}

void Session::require_at_rest() const {
  require_usable();
  if (status_.stepping())
    throw Refusal(v1::REASON_SIMULATION_BUSY,
                  "a call advances the simulation; inputs are written between advances");
}

void Session::write(const v1::WriteVariablesRequest& request, const Call& call,
                    const KeptReplies::Turn& turn, v1::WriteVariablesReply* reply) {
  variables_.check_inputs(request.values(), "values");
  require_at_rest();
  const CallGuard lock(lock_, call);
  require_at_rest();  // still
  if (request.has_expected_step()) check_step(request.expected_step(), *simulation_);
  storage_.note_change();
  reply->set_step(simulation_->step_number());
  if (storage_.has_journal()) {
    const MemoryShare share(shared_.memory, size_of(simulation_->state()));
    const Status stored = simulation_->look_from(simulation_->state(), [&]() TS_REQUIRES(lock_) {
      variables_.write(request.values(), *simulation_);
      storage_.store_change(*simulation_, turn, *reply);
    });
    if (!stored) throw Refusal(stored.error());
  }
  variables_.write(request.values(), *simulation_);
  if (recorder_) recorder_->inputs(request.values());
}

// ------------------------------------------------------------------ results

SessionResults& Session::results() const {
  if (!results_)
    throw Refusal(v1::REASON_NO_RESULTS, "the simulation was created without `results`");
  return *results_;
}

void Session::list_results(const Call& call, v1::ListResultsReply* out) {
  SessionResults& files = results();
  const CallGuard lock(lock_, call);
  files.list(out);
}

std::int64_t Session::size_of_result(const std::string& file, const Call& call,
                                     std::int64_t* cuts) {
  SessionResults& files = results();
  const CallGuard lock(lock_, call);
  return files.size_of(file, cuts);
}

// ------------------------------------------------------------------ telemetry

void Session::subscribe(const SubscriptionPtr& subscription,
                        const google::protobuf::RepeatedField<int>& handles) {
  variables_.check(handles);
  std::vector<int> sizes;
  for (const int handle : handles) sizes.push_back(variables()[handle].size);
  telemetry_->add(subscription, sizes);
}

// ------------------------------------------------------------------ end of life

void Session::close() {
  lease_.end();
  status_.interrupt();
  telemetry_->close();
  for (const auto& port : coupler_.ports()) port->end(gone());
}

// At once, not when the last stream lets go of the session: another simulation may want the paths.
void Session::close_deck_sockets() {
  if (!deck_sockets_) return;
  const Guard lock(lock_);
  deck_sockets_->end();
}

Session::Use::Use(Session& session) : lease_(session.lease_) {
  if (!lease_.take()) throw session.gone();
}

}  // namespace mbcosim::server
