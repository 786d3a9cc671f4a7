/// Methods that advance simulations.

#include <algorithm>
#include <atomic>
#include <cmath>
#include <optional>

#include "service/durability.h"
#include "service/durations.h"
#include "service/row_table.h"
#include "service/simulations_service.h"

namespace mbcosim::server {
namespace {

using Clock = std::chrono::steady_clock;

// ------------------------------------------------------------------ StepStream

/// Between its steps an open stream costs no thread. It holds the simulation that it stepped last.
class StepStreamHandler final : public Handler {
 public:
  explicit StepStreamHandler(const Parts& parts) : parts_(parts) {}

 private:
  // Clients open the stream before they know when they will step.
  void start(Exchange& exchange) override { exchange.read(Exchange::kIdleStream); }
  void on_message(Exchange& exchange, grpc::ByteBuffer message) override {
    if (message.Length() <= kShortMessage)
      return exchange.do_at_once([&] {
        parse(exchange.memory(), message, &request_, &share_);
        step_at_once(exchange);
      });
    exchange.post(Lane::advance, [this, &exchange, bytes = std::move(message)]() mutable {
      parse(exchange.memory(), bytes, &request_, &share_);
      step(exchange);
    });
  }
  // Another thread would take as long to wake as a small model to step.
  void step_at_once(Exchange& exchange) {
    if (is_held(exchange.caller()) || hold_alive(exchange.caller())) {
      if ((*session_)->is_quick()) {
        prepare(exchange);
        if ((*session_)->step_at_once(request_, exchange.caller(), exchange.call(),
                                      reply_.mutable_step()))
          return send(exchange);
      }
    }
    exchange.post(Lane::advance, [this, &exchange] { step(exchange); });
  }
  void step(Exchange& exchange) {
    if (!is_held(exchange.caller())) hold(exchange);
    prepare(exchange);
    (*session_)->step(request_, exchange.caller(), exchange.call(), reply_.mutable_step());
    send(exchange);
  }
  /// Is it the simulation that the message means, and may the caller still advance it?
  bool is_held(const Caller& caller) const {
    return session_ && (request_.simulation().empty() || request_.simulation() == name_) &&
           (*session_)->grants().allow(caller, Access::control);
  }
  /// Only of one that is in memory: from the disk it takes a while.
  bool hold_alive(const Caller& caller) {
    SessionPtr session = parts_.store.get_alive(request_.simulation(), caller, Access::control);
    if (!session || !session->lease().take()) return false;
    name_ = request_.simulation();
    session_.emplace(std::move(session), std::adopt_lock);
    return true;
  }
  void hold(Exchange& exchange) {
    name_ = request_.simulation();
    session_.emplace(parts_.store, name_, exchange.caller(), exchange.call(), Access::control);
  }
  void prepare(Exchange& exchange) {
    request_.set_simulation(
        name_);  // a repeat in another message of the stream is the same request
    reply_.Clear();
    outputs_share_ =
        MemoryShare(exchange.memory(), (*session_)->variable_access().bytes_of(request_.outputs()));
  }
  // The next message may come, on another thread, as soon as it is wanted: nothing here is touched
  // from then on.
  void send(Exchange& exchange) {
    const bool taken = exchange.all_written();  // the last reply, by the client
    exchange.write(serialized(reply_));
    wants_next_.store(true);
    if (taken || exchange.all_written()) read_next(exchange);
  }
  void read_next(Exchange& exchange) {
    if (wants_next_.exchange(false)) exchange.read();
  }
  void on_written(Exchange& exchange) override { read_next(exchange); }
  void on_half_close(Exchange& exchange) override { exchange.finish(grpc::Status::OK); }

  const Parts& parts_;
  std::string name_;  ///< of the session
  std::optional<SessionHold> session_;
  MemoryShare share_, outputs_share_;  ///< of the request and of the reply
  v1::StepRequest request_;
  v1::StepStreamReply reply_;
  std::atomic<bool> wants_next_{false};
};

// ------------------------------------------------------------------ Run

/// Progress of a run at an even pace.
class Progress {
 public:
  Progress(const Session& session, const v1::RunRequest& request) : session_(session) {
    session_.fill(&info_);
    start_step_ = info_.step();
    start_time_ = info_.time();
    steps_ = request.step().has_steps() ? request.step().steps() : -1;
    end_time_ = info_.final_time();
    if (request.step().has_until_time())
      end_time_ = std::min(end_time_, request.step().until_time());
    if (request.has_progress_interval())
      interval_ =
          span_of(request.progress_interval(), "progress_interval", std::chrono::milliseconds(20));
  }

  /// Sends what is due, unless the client has not taken the last one.
  void send(Exchange& exchange) {
    const Clock::time_point now = Clock::now();
    if (now - last_ < interval_ || !exchange.all_written()) return;
    last_ = now;
    session_.fill(&info_);
    const double elapsed = std::chrono::duration<double>(now - started_).count();
    const double fraction = done_fraction();
    v1::RunProgress* progress = message_.mutable_progress();
    progress->set_step(info_.step());
    progress->set_time(info_.time());
    if (fraction >= 0) progress->set_fraction(fraction);
    if (fraction > 0) progress->set_remaining_seconds(elapsed * (1 - fraction) / fraction);
    exchange.write(serialized(message_));
  }

 private:
  double done_fraction() const {
    double fraction = -1;
    if (steps_ > 0)
      fraction = static_cast<double>(info_.step() - start_step_) / static_cast<double>(steps_);
    if (std::isfinite(end_time_) && end_time_ > start_time_)
      fraction = std::max(fraction, (info_.time() - start_time_) / (end_time_ - start_time_));
    return std::min(fraction, 1.0);
  }

  const Session& session_;
  v1::SimulationInfo info_;
  v1::RunReply message_;
  std::int64_t start_step_ = 0, steps_ = -1;
  double start_time_ = 0, end_time_ = 0;
  std::chrono::milliseconds interval_{500};
  Clock::time_point started_ = Clock::now(), last_ = started_;
};

/// Sends rows as they come. The client is waited for: none is left out.
class Rows {
 public:
  Rows(const Session& session, const v1::RunRequest& request, MemoryBudget& memory) {
    if (request.has_table()) table_.emplace(request.table(), session.variable_access(), memory);
  }
  RowTable* table() { return table_ ? &*table_ : nullptr; }
  /// Sends when there are many, or some for a while. Throws READER_STALLED.
  void send(Exchange& exchange) {
    constexpr std::chrono::milliseconds kFresh(50);
    if (!table_ || table_->empty()) return;
    if (table_->full() || Clock::now() - last_ >= kFresh) flush(exchange);
  }
  void flush(Exchange& exchange) {
    constexpr std::chrono::seconds kPatience(30);
    if (!table_ || table_->empty()) return;
    last_ = Clock::now();
    table_->take(message_.mutable_rows());
    if (exchange.write_by(serialized(message_), last_ + kPatience)) return;
    throw Refusal(v1::REASON_READER_STALLED, "the rows of the table were not read for 30 s");
  }

 private:
  std::optional<RowTable> table_;
  v1::RunReply message_;
  Clock::time_point last_ = Clock::now();
};

class RunHandler final : public OneRequest<v1::RunRequest> {
 public:
  explicit RunHandler(const Parts& parts) : OneRequest(Lane::advance), parts_(parts) {}

 private:
  void serve(Exchange& exchange, const v1::RunRequest& request) override {
    const SessionHold session(parts_.store, request.step().simulation(), exchange.caller(),
                              exchange.call(), Access::control);
    Progress progress(*session, request);
    Rows rows(*session, request, exchange.memory());
    share().grow(session->variable_access().bytes_of(request.step().outputs()));
    v1::RunReply done;
    const auto send = [&] {
      rows.send(exchange);
      progress.send(exchange);
    };
    session->step(request.step(), exchange.caller(), exchange.call(), done.mutable_done(), send,
                  rows.table());
    rows.flush(exchange);
    exchange.end(serialized(done));
  }

  const Parts& parts_;
};

}  // namespace

void add_stepping(Gate& gate, const Parts& parts) {
  gate.add(simulations_path("Step"),
           on_session<v1::StepRequest, v1::StepReply>(
               parts, Role::control, Lane::advance,
               [](Session& session, const v1::StepRequest& request, v1::StepReply* reply,
                  const CallFrame& frame) {
                 frame.share.grow(session.variable_access().bytes_of(request.outputs()));
                 session.step(request, frame.caller, frame.call, reply);
               },
               std::nullopt,
               [](Session& session, const v1::StepRequest& request, v1::StepReply* reply,
                  const CallFrame& frame) {
                 const MemoryShare outputs(frame.memory,
                                           session.variable_access().bytes_of(request.outputs()));
                 return session.step_at_once(request, frame.caller, frame.call, reply);
               }));
  gate.add(simulations_path("StepStream"),
           stream(Role::control, [&parts] { return std::make_unique<StepStreamHandler>(parts); }));
  gate.add(simulations_path("Run"),
           stream(Role::control, [&parts] { return std::make_unique<RunHandler>(parts); }));
  gate.add(simulations_path("Interrupt"),
           unary<v1::InterruptRequest, v1::InterruptReply>(
               Role::control, Lane::quick,
               [&parts](const CallFrame& frame, const auto& request, auto* reply) {
                 const std::string& name = request.simulation();
                 if (parts.durability.knows(name, frame.caller)) return;  // it rests
                 const SessionPtr session =
                     parts.store.get(name, frame.caller, frame.call, Access::control);
                 once(*session, frame, request, reply,
                      [&] { reply->set_was_stepping(session->interrupt()); });
               }));
}

}  // namespace mbcosim::server
