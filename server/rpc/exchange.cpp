#include "rpc/exchange.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <new>
#include <thread>

namespace mbcosim::server {
namespace {

constexpr std::chrono::seconds kLinger{10};  // that long an ended call waits for its client to read
constexpr std::chrono::milliseconds kForMemory{20};  // is waited when there is none for a call

}  // namespace

grpc::Status status_of_exception(const Runtime& runtime, const std::string& method,
                                 const std::string& identity) {
  const auto told = [&](const Refusal& refusal) {
    if (runtime.on_refusal) runtime.on_refusal(method, identity, refusal);
    return refusal.status();
  };
  try {
    throw;
  } catch (const Refusal& refusal) {
    return told(refusal);
  } catch (const std::bad_alloc&) {
    return told(limit_refusal("memory", 0, "the server is out of memory"));
  } catch (const std::exception& error) {
    spdlog::error("{}: {}", method, error.what());
    return told(Refusal(v1::REASON_INTERNAL, "internal error in " + method));
  }
}

void Handler::start(Exchange& exchange) { exchange.read(Exchange::kMessageWait); }

// ------------------------------------------------------------------ beginning

// Whatever begins an operation holds the lock: its end is not looked at before.
void Exchange::await(grpc::AsyncGenericService& service, grpc::ServerCompletionQueue& queue) {
  Guard guard(mutex_);
  rpc_->context.AsyncNotifyWhenDone(&course_);
  service.RequestCall(&rpc_->context, &rpc_->stream, &queue, &queue, &coming_);
  operations_ = 2;  // the call's coming and its course
  self_ = shared_from_this();
}

void Exchange::has_come(bool ok) {
  if (!ok) return let_go(2);  // the server ends; what did not come takes no course
  gate_.await_call();
  const grpc::GenericServerContext* context = nullptr;
  bool over = false;
  {
    Guard guard(mutex_);
    came_ = true;
    context = &rpc_->context;  // stays until this lets go
    over = over_early_;
    if (over) cancel();
  }
  guarded([&] {
    note_peer(context->peer());
    if (!over) start(*context);
  });
  let_go();
}

void Exchange::note_peer(std::string peer) {
  gate_.counts_.add(peer);
  Guard guard(mutex_);
  peer_ = std::move(peer);
}

void Exchange::start(const grpc::GenericServerContext& context) {
  method_ = context.method();
  if (gate_.closing()) throw shutting_down();
  const Method* method = gate_.find(method_);
  if (!method)
    throw Refusal(v1::REASON_NOT_SERVED, "no method is named \"" + method_.substr(0, 100) + "\"");
  if (!method->open) caller_ = runtime_.authenticator.check(context, method->role);
  label(context);
  if (method->counted != Counted::no) take_place(method->counted == Counted::stream);
  stream_ = method->counted == Counted::stream;
  handler_ = method->make();
  handler_->start(*this);
}

void Exchange::label(const grpc::GenericServerContext& context) {
  const auto service = method_.rfind('.');  // of "/mbcosim.v1.Simulations/Step"
  labels_.method = service == std::string::npos ? method_ : method_.substr(service + 1);
  labels_.identity = caller_.identity;
  const auto found = context.client_metadata().find("traceparent");
  if (found != context.client_metadata().end())
    labels_.trace_id = trace_id_of({found->second.data(), found->second.size()});
}

void Exchange::take_place(bool stream) {
  const std::string connection = peer();
  Admission::Ticket ticket = runtime_.admission.admit(
      caller_.identity, is_told_apart(connection) ? connection : "", stream);
  Guard guard(mutex_);
  ticket_ = std::move(ticket);
}

void Exchange::guarded(const std::function<void()>& body) noexcept {
  const CallScope scope(labels_);
  try {
    try {
      body();
    } catch (...) {
      grpc::Status status = status_of_exception(runtime_, method_, caller_.identity);
      const bool by_us = gate_.closing() && status.error_code() == grpc::StatusCode::CANCELLED;
      finish(by_us ? shutting_down().status() : std::move(status));
    }
  } catch (...) {  // no memory for a status either
    hang_up();
  }
}

// ------------------------------------------------------------------ for handlers

std::string Exchange::peer() const {
  Guard guard(mutex_);
  return peer_;
}

void Exchange::read(std::optional<Clock::duration> longest) {
  Guard guard(mutex_);
  if (!came_ || finished_) return;
  if (longest) {
    wait_ = runtime_.timer.after(*longest, [weak = weak_from_this(), wait = *longest] {
      if (const auto self = weak.lock()) self->message_is_late(wait);
    });
  }
  ++operations_;
  rpc_->stream.Read(&in_, &reading_);
}

void Exchange::message_is_late(Clock::duration longest) {
  {
    Guard guard(mutex_);
    if (wait_ == 0) return;
  }
  guarded([&] {
    const auto seconds = std::chrono::duration_cast<std::chrono::seconds>(longest).count();
    throw Refusal(v1::REASON_OUT_OF_TURN,
                  "no message came within " + std::to_string(seconds) + " s");
  });
}

void Exchange::write(grpc::ByteBuffer message) {
  Guard guard(mutex_);
  if (!came_ || end_) return;
  queue_.push_back(std::move(message));
  go_on();
}

bool Exchange::all_written() const {
  Guard guard(mutex_);
  return !writing_;
}

bool Exchange::write_by(grpc::ByteBuffer message, Clock::time_point deadline,
                        const std::function<bool()>& gives_up) {
  constexpr std::chrono::milliseconds kLook(10);
  Guard guard(mutex_);
  while (writing_ && !end_ && Clock::now() < deadline && !(gives_up && gives_up()))
    written_.wait_until(mutex_, gives_up ? std::min(deadline, Clock::now() + kLook) : deadline);
  if (writing_ || end_ || !came_) return false;
  queue_.push_back(std::move(message));
  go_on();
  return true;
}

void Exchange::finish(grpc::Status status) {
  Guard guard(mutex_);
  want_finish(std::move(status));
}

void Exchange::end(grpc::ByteBuffer message) {
  Guard guard(mutex_);
  if (!came_ || end_) return;
  queue_.push_back(std::move(message));
  want_finish(grpc::Status::OK);
}

void Exchange::hang_up() {
  Guard guard(mutex_);
  if (came_) rpc_->context.TryCancel();
}

void Exchange::post(Lane lane, std::function<void()> work) {
  {
    Guard guard(mutex_);
    ++jobs_;
  }
  auto job = [self = shared_from_this(), work = std::move(work)] {
    if (!self->call_.cancelled()) self->guarded(work);
    self->end_job();
  };
  try {
    runtime_.lanes.post(lane, caller_.identity, std::move(job));
  } catch (...) {
    end_job();
    throw;
  }
}

void Exchange::do_at_once(const std::function<void()>& work) {
  {
    Guard guard(mutex_);
    ++jobs_;
  }
  {
    const Pollers::Work of_poller;
    guarded(work);
  }
  end_job();
}

void Exchange::end_job() {
  Guard guard(mutex_);
  --jobs_;
  if (closing_ && jobs_ == 0) want_finish(shutting_down().status());
}

void Exchange::shut_down() {
  call_.cancel();
  Guard guard(mutex_);
  closing_ = true;
  if (jobs_ == 0) want_finish(shutting_down().status());
}

void Exchange::abandon() { finish(shutting_down().status()); }

// ------------------------------------------------------------------ writing

void Exchange::want_finish(grpc::Status status) {
  if (!came_ || end_) return;
  end_ = std::move(status);
  written_.notify_all();
  go_on();
  if (finished_) return;
  linger_ = runtime_.timer.after(kLinger, [weak = weak_from_this()] {
    if (const auto self = weak.lock()) self->hang_up();
  });
}

// Starts what may be started: gRPC takes one write at a time.
void Exchange::go_on() {
  if (writing_ || finished_) return;
  if (queue_.empty()) {
    if (!end_) return;
    finished_ = true;
    ++operations_;
    rpc_->stream.Finish(*end_, &finishing_);
    return;
  }
  out_ = std::move(queue_.front());
  queue_.pop_front();
  if (end_ && queue_.empty()) {
    finished_ = true;
    ++operations_;
    rpc_->stream.WriteAndFinish(out_, {}, *end_, &finishing_);
    return;
  }
  writing_ = true;
  ++operations_;
  rpc_->stream.Write(out_, &sending_);
}

// ------------------------------------------------------------------ from gRPC

void Exchange::has_read(bool ok) {
  Timer::Id wait = 0;
  {
    Guard guard(mutex_);
    wait = std::exchange(wait_, 0);
  }
  if (wait != 0) runtime_.timer.cancel(wait);
  if (!call_.cancelled()) {
    guarded([&] {
      if (!ok) return handler_->on_half_close(*this);
      grpc::ByteBuffer message;
      message.Swap(&in_);
      handler_->on_message(*this, std::move(message));
    });
  }
  let_go();
}

void Exchange::has_written(bool ok) {
  bool goes_on = false;
  {
    Guard guard(mutex_);
    writing_ = false;
    out_.Clear();
    if (!ok) queue_.clear();
    go_on();
    goes_on = writing_ || end_;
  }
  if (!goes_on) {
    written_.notify_all();
    if (ok) guarded([&] { handler_->on_written(*this); });
  }
  let_go();
}

void Exchange::has_finished(bool) { let_go(); }

void Exchange::is_over(bool) {
  bool cancelled = false;
  {
    Guard guard(mutex_);
    over_early_ = !came_;
    cancelled = came_ && rpc_->context.IsCancelled();
  }
  if (cancelled) {
    call_.cancel();
    Guard guard(mutex_);
    cancel();
  }
  let_go();
}

void Exchange::cancel() {
  queue_.clear();
  if (!end_) {
    end_ = grpc::Status::CANCELLED;
    written_.notify_all();
  }
  go_on();
}

void Exchange::let_go(int operations) {
  {
    Guard guard(mutex_);
    operations_ -= operations;
    if (operations_ > 0) return;
  }
  leave();
}

void Exchange::leave() {
  bool delivered = false;
  Timer::Id linger = 0, wait = 0;
  std::shared_ptr<Exchange> self;
  std::unique_ptr<Rpc> rpc;
  {
    Guard guard(mutex_);
    delivered = came_ && !rpc_->context.IsCancelled();
    came_ = false;
    rpc = std::move(rpc_);
    ticket_ = {};
    linger = std::exchange(linger_, 0);
    wait = std::exchange(wait_, 0);
    self = std::move(self_);
  }
  rpc.reset();
  call_.cancel();
  written_.notify_all();
  if (linger != 0) runtime_.timer.cancel(linger);
  if (wait != 0) runtime_.timer.cancel(wait);
  gate_.forget(this);
  if (handler_) guarded([&] { handler_->on_done(*this, delivered); });
  // The handler of a stream may hold the last share of a simulation, which takes a while to free.
  if (stream_) guarded([&] { runtime_.lanes.post(Lane::quick, caller_.identity, [self] {}); });
}

// ------------------------------------------------------------------ the gate

void Gate::open(grpc::ServerCompletionQueue& queue) {
  queue_ = &queue;
  await_call();
}

const Method* Gate::find(const std::string& path) const {
  const auto found = methods_.find(path);
  return found == methods_.end() ? nullptr : &found->second;
}

// Without memory for a call none can be answered: those that come wait until there is some, or the
// server ends.
void Gate::await_call() noexcept {
  while (!begin_call() && !closing()) std::this_thread::sleep_for(kForMemory);
}

// False: there is no memory for it.
bool Gate::begin_call() noexcept {
  std::shared_ptr<Exchange> exchange;
  try {
    exchange = std::make_shared<Exchange>(*this, runtime_);
    {
      Guard guard(mutex_);
      calls_.emplace(exchange.get(), exchange);
    }
    exchange->await(service_, *queue_);
    return true;
  } catch (const std::bad_alloc&) {
    forget(exchange.get());
    return false;
  }
}

void Gate::forget(Exchange* exchange) {
  Guard guard(mutex_);
  calls_.erase(exchange);
  if (calls_.empty()) forgotten_.notify_all();
}

bool Gate::empty_within(std::chrono::milliseconds wait) {
  const auto end = std::chrono::steady_clock::now() + wait;
  Guard guard(mutex_);
  while (!calls_.empty() && std::chrono::steady_clock::now() < end)
    forgotten_.wait_until(mutex_, end);
  return calls_.empty();
}

std::vector<std::shared_ptr<Exchange>> Gate::open_calls() {
  std::vector<std::shared_ptr<Exchange>> calls;
  Guard guard(mutex_);
  for (const auto& [exchange, weak] : calls_)
    if (auto call = weak.lock()) calls.push_back(std::move(call));
  return calls;
}

CallCounts::Counts Gate::alive_by_connection() {
  CallCounts::Counts counts;
  for (const auto& call : open_calls()) ++counts[call->peer()];
  return counts;
}

void Gate::close() {
  closing_.store(true);
  const auto calls = open_calls();
  for (const auto& call : calls) call->call().cancel();  // first: a step ends before its peers do
  for (const auto& call : calls) call->shut_down();
}

void Gate::abandon() {
  for (const auto& call : open_calls()) call->abandon();
}

}  // namespace mbcosim::server
