#include "service/session.h"

#include <google/protobuf/util/time_util.h>

#include <cmath>

#include "service/session_advance.h"
#include "wire/convert.h"
#include "wire/refusal.h"

namespace mbcosim::server {
namespace {

using Clock = std::chrono::steady_clock;
constexpr auto kBlockSlice =
    std::chrono::milliseconds(20);  // longest wait for a subscriber before looking round

}  // namespace

Session::Session(Identity identity, std::unique_ptr<Simulation> simulation, Shared shared,
                 const v1::CreateOptions& options)
    : identity_(std::move(identity)),
      shared_(shared),
      model_(&simulation->model()),
      variables_(&simulation->variables()),
      simulation_(std::move(simulation)),
      recorder_(options.record_ports() ? std::make_unique<Recorder>(shared.limits.record_bytes)
                                       : nullptr),
      coupler_(options.ports(), *simulation_, identity_.lease, recorder_.get()),
      last_use_(Clock::now().time_since_epoch().count()) {
  published_.display_name = identity_.display_name;
  set_policy(options.non_convergence_policy(), options.minimum_step_s());
  publish();
  if (recorder_) start_record(options);
}

void Session::start_record(const v1::CreateOptions& options) {
  v1::RecordEntry entry;
  v1::RecordHeader* header = entry.mutable_header();
  header->set_protocol_version(1);
  header->set_model_digest(digest_text(model_->digest));
  header->set_step(simulation_->step_number());
  header->set_time_s(simulation_->time());
  *header->mutable_ports() = options.ports();
  header->set_summed_time(options.summed_time());
  if (simulation_->step_number() > 0) header->set_state(simulation_->export_state());
  for (const auto& port : coupler_.ports()) *header->add_layouts() = port->model().layout();
  header->set_non_convergence_policy(to_proto(published_.policy));
  header->set_minimum_step_s(published_.policy.minimum);
  recorder_->add(entry);
}

// ------------------------------------------------------------------ choices

void Session::set_policy(v1::NonConvergencePolicy kind, double minimum) {
  if (!v1::NonConvergencePolicy_IsValid(kind))
    throw Refusal(v1::REASON_BAD_ARGUMENT, "`non_convergence_policy` is unknown to this server");
  if (!(minimum >= 0) || std::isinf(minimum))
    throw Refusal(v1::REASON_BAD_ARGUMENT, "`minimum_step_s` must be a finite number, at least 0");
  StepPolicy policy;
  policy.kind = kind == v1::NON_CONVERGENCE_POLICY_CUT_STEP         ? StepPolicy::cut
                : kind == v1::NON_CONVERGENCE_POLICY_ACCEPT_FLAGGED ? StepPolicy::accept
                                                                    : StepPolicy::fail;
  policy.minimum = minimum;
  simulation_->set_policy(policy);
  std::lock_guard guard(published_mutex_);
  published_.policy = policy;
}

void Session::update(const v1::UpdateSimulationRequest& request) {
  std::lock_guard lock(lock_);
  const StepPolicy now = simulation_->policy();
  if (request.has_non_convergence_policy() || request.has_minimum_step_s())
    set_policy(
        request.has_non_convergence_policy() ? request.non_convergence_policy() : to_proto(now),
        request.has_minimum_step_s() ? request.minimum_step_s() : now.minimum);
  std::lock_guard guard(published_mutex_);
  if (request.has_display_name()) published_.display_name = request.display_name();
}

const Recorder& Session::record() const {
  if (!recorder_)
    throw Refusal(v1::REASON_NOT_RECORDING, "the simulation was created without `record_ports`");
  return *recorder_;
}

// ------------------------------------------------------------------ telling

void Session::fill(v1::SimulationInfo* out) const {
  Published p;
  {
    std::lock_guard guard(published_mutex_);
    p = published_;
  }
  out->set_name(identity_.id);
  out->set_display_name(p.display_name);
  out->set_non_convergence_policy(to_proto(p.policy));
  out->set_minimum_step_s(p.policy.minimum);
  out->set_owner(identity_.owner);
  out->set_state(p.failed           ? v1::SIMULATION_STATE_FAILED
                 : stepping_.load() ? v1::SIMULATION_STATE_STEPPING
                 : p.finished       ? v1::SIMULATION_STATE_FINISHED
                                    : v1::SIMULATION_STATE_READY);
  out->set_step(p.step);
  out->set_time_s(p.time);
  out->set_next_step_s(p.next_step);
  out->set_model_digest(digest_text(model_->digest));
  out->set_final_time_s(model_->initial_value.final_time);
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
  out->set_waiting_for(text);
}

void Session::fill(v1::ModelDescription* out, const std::string& variable_prefix) const {
  to_proto(*model_, out);
  for (std::size_t i = 0; i < variables_->size(); ++i) {
    const Variable& variable = (*variables_)[i];
    if (variable.name.compare(0, variable_prefix.size(), variable_prefix) == 0)
      to_proto(variable, static_cast<int>(i), out->add_variables());
  }
  for (const auto& port : coupler_.ports()) port->fill(out->add_ports());
}

void Session::publish() {
  std::lock_guard guard(published_mutex_);
  published_.step = simulation_->step_number();
  published_.time = simulation_->time();
  published_.next_step = simulation_->next_step_size();
  published_.finished = simulation_->finished();
}

void Session::fail(const std::string& why) {
  std::lock_guard guard(published_mutex_);
  published_.failed = true;
  published_.last_failure = why;
}

void Session::remember_failure(const std::string& why) {
  std::lock_guard guard(published_mutex_);
  published_.last_failure = why;
}

Port& Session::port(const std::string& name) const {
  if (Port* found = coupler_.find(name)) return *found;
  throw Refusal(v1::REASON_NO_SUCH_PORT,
                identity_.id + " has no port named \"" + name.substr(0, 100) + "\"");
}

void Session::require_usable() const {
  if (closed_.load()) throw Refusal(v1::REASON_NO_SUCH_SIMULATION, "the simulation was deleted");
  std::lock_guard guard(published_mutex_);
  if (published_.failed)
    throw Refusal(v1::REASON_SIMULATION_FAILED,
                  "the simulation has failed; restore a snapshot or delete it");
}

// ------------------------------------------------------------------ checks

void Session::check_handle(int handle) const {
  if (handle >= 0 && handle < static_cast<int>(variables_->size())) return;
  throw Refusal(v1::REASON_NO_SUCH_VARIABLE, "no variable has handle " + std::to_string(handle) +
                                                 "; there are " +
                                                 std::to_string(variables_->size()));
}

void Session::check_inputs(const v1::Values& inputs) const {
  std::int64_t size = 0;
  for (const int handle : inputs.handles()) {
    check_handle(handle);
    const Variable& variable = (*variables_)[handle];
    if (variable.causality != Causality::input && variable.causality != Causality::parameter)
      throw Refusal(v1::REASON_NOT_WRITABLE,
                    "variable \"" + utf8(variable.name) + "\" is neither an input nor a parameter");
    size += variable.size;
  }
  if (size != inputs.values_size())
    throw Refusal(v1::REASON_BAD_ARGUMENT, "the variables to write take " + std::to_string(size) +
                                               " values, got " +
                                               std::to_string(inputs.values_size()));
  for (const double value : inputs.values())
    if (!std::isfinite(value))
      throw Refusal(v1::REASON_BAD_ARGUMENT, "a value to write is not finite");
}

void Session::check(const v1::StepRequest& request) const {
  if (request.has_steps() && request.steps() < 0)
    throw Refusal(v1::REASON_BAD_ARGUMENT,
                  "`steps` must not be negative, got " + std::to_string(request.steps()));
  if (request.has_until_time_s() && std::isnan(request.until_time_s()))
    throw Refusal(v1::REASON_BAD_ARGUMENT, "`until_time_s` is not a number");
  if (request.step_size_s() != 0)
    throw Refusal(v1::REASON_NOT_SERVED,
                  "`step_size_s` is not served: the deck's strategy sets the step");
  if (request.has_until()) {
    check_handle(request.until().handle());
    const int size = (*variables_)[request.until().handle()].size;
    if (request.until().element() < 0 || request.until().element() >= size)
      throw Refusal(v1::REASON_BAD_ARGUMENT,
                    "`until.element` must be from 0 to " + std::to_string(size - 1));
    if (request.until().comparison() == v1::COMPARISON_UNSPECIFIED)
      throw Refusal(v1::REASON_BAD_ARGUMENT, "`until.comparison` is missing");
  }
  for (const int handle : request.outputs()) check_handle(handle);
  check_inputs(request.inputs());
}

void Session::check_step(std::int64_t expected) const {
  const std::int64_t step = simulation_->step_number();
  if (expected == step) return;
  throw Refusal(v1::REASON_WRONG_STEP,
                "expected step " + std::to_string(expected) + ", the simulation is at step " +
                    std::to_string(step),
                {{"step", std::to_string(step)}});
}

bool Session::replay(const v1::StepRequest& request, v1::StepReply* reply) const {
  if (request.request_id().empty() || request.request_id() != last_reply_.request_id())
    return false;
  *reply = last_reply_;
  return true;
}

void Session::apply_inputs(const v1::Values& inputs) {
  const double* value = inputs.values().data();
  for (const int handle : inputs.handles()) {
    const std::size_t size = (*variables_)[handle].size;
    const auto status = simulation_->set(handle, {value, size});
    if (!status) throw Refusal(status.error());
    value += size;
  }
}

void Session::read_values(const google::protobuf::RepeatedField<int>& handles,
                          google::protobuf::RepeatedField<double>* out) {
  scratch_.clear();
  for (const int handle : handles) simulation_->get(handle, scratch_);
  out->Add(scratch_.begin(), scratch_.end());
}

bool Session::interrupt() {
  std::lock_guard guard(published_mutex_);
  if (!running_) return false;
  running_->cancel();
  return true;
}

// ------------------------------------------------------------------ reading and writing

void Session::read(const v1::ReadVariablesRequest& request, v1::ReadVariablesReply* reply) {
  require_usable();
  for (const int handle : request.handles()) check_handle(handle);
  std::lock_guard lock(lock_);
  reply->set_step(simulation_->step_number());
  reply->set_time_s(simulation_->time());
  read_values(request.handles(), reply->mutable_values());
}

void Session::write(const v1::WriteVariablesRequest& request, v1::WriteVariablesReply* reply) {
  require_usable();
  check_inputs(request.values());
  if (stepping_.load())
    throw Refusal(v1::REASON_SIMULATION_BUSY,
                  "a call advances the simulation; inputs are written between advances");
  std::lock_guard lock(lock_);
  if (request.has_expected_step()) check_step(request.expected_step());
  apply_inputs(request.values());
  if (recorder_) recorder_->inputs(request.values());
  reply->set_step(simulation_->step_number());
}

// ------------------------------------------------------------------ telemetry

void Session::subscribe(std::shared_ptr<TelemetryBuffer> buffer) {
  for (const int handle : buffer->handles()) check_handle(handle);
  std::lock_guard guard(subscribers_mutex_);
  if (closed_.load()) buffer->close();
  subscribers_.push_back(std::move(buffer));
  has_subscribers_.store(true);
}

void Session::unsubscribe(const std::shared_ptr<TelemetryBuffer>& buffer) {
  buffer->close();
  std::lock_guard guard(subscribers_mutex_);
  std::erase(subscribers_, buffer);
  has_subscribers_.store(!subscribers_.empty());
}

void Session::take_samples(Advance& advance) {
  std::lock_guard guard(subscribers_mutex_);
  for (const auto& buffer : subscribers_) {
    if (!buffer->wants(simulation_->step_number())) continue;
    v1::Sample sample;
    sample.set_step(simulation_->step_number());
    sample.set_time_s(simulation_->time());
    scratch_.clear();
    for (const int handle : buffer->handles()) simulation_->get(handle, scratch_);
    sample.mutable_values()->Add(scratch_.begin(), scratch_.end());
    if (!buffer->offer(sample)) advance.pending.push_back({buffer, std::move(sample)});
  }
}

// Without lock and slot: nobody else waits for a slow reader. True: all delivered.
bool Session::deliver_samples(Advance& advance) {
  if (advance.pending.empty()) return true;
  for (auto& pending : advance.pending) pending.buffer->wait_for_room(kBlockSlice);
  std::erase_if(advance.pending,
                [](Advance::Pending& pending) { return pending.buffer->offer(pending.sample); });
  if (advance.token.cancelled()) advance.pending.clear();
  return advance.pending.empty();
}

// ------------------------------------------------------------------ end of life

void Session::close() {
  closed_.store(true);
  interrupt();
  std::lock_guard guard(subscribers_mutex_);
  for (const auto& buffer : subscribers_) buffer->close();
}

Session::Use::Use(Session& session) : session_(session) { session_.uses_.fetch_add(1); }

Session::Use::~Use() {
  session_.last_use_.store(Clock::now().time_since_epoch().count());
  session_.uses_.fetch_sub(1);
}

bool Session::lease_is_over(Clock::time_point now) const {
  const Clock::time_point last{Clock::duration(last_use_.load())};
  return uses_.load() == 0 && now - last > identity_.lease;
}

}  // namespace mbcosim::server
