#include "service/coupling_service.h"

#include "service/peer_seat.h"

namespace mbcosim::server {
namespace {

/// The stream of one peer: the session's thread sends, answers are handed over as they come.
/// Between exchanges an attached peer costs no thread.
class AttachHandler final : public Handler, public PeerLink {
 public:
  explicit AttachHandler(const Parts& parts) : parts_(parts) {}

 private:
  using Clock = std::chrono::steady_clock;

  void start(Exchange& exchange) override {
    exchange_ = &exchange;
    Handler::start(exchange);
  }
  void on_message(Exchange& exchange, grpc::ByteBuffer bytes) override {
    parse(exchange.memory(), bytes, &message_, &share_);
    if (!greeted_) return exchange.post(Lane::work, [this, &exchange] { greet(exchange); });
    const Pollers::Work of_poller;
    try {
      Guard guard(mutex_);
      if (!seat_) return;  // given up meanwhile: the call ends, whatever the peer still sends
      seat_->receive(message_);
    } catch (...) {
      return leave(exchange, status_of_exception(parts_.runtime, exchange.method(),
                                                 exchange.caller().identity));
    }
    exchange.read();
  }
  void greet(Exchange& exchange) {
    if (!message_.has_hello())
      throw Refusal(v1::REASON_OUT_OF_TURN, "the first message must be `hello`");
    auto seat = std::make_unique<PeerSeat>(parts_, message_.hello(), exchange.caller(),
                                           exchange.call(), *this);
    exchange.write(serialized(seat->welcome()));
    seat->begin();
    {
      Guard guard(mutex_);
      if (over_) return;
      seat_ = std::move(seat);
      greeted_ = true;
      if (seat_->heart().needed()) wait_for_beat();
    }
    exchange.read();
  }
  void on_half_close(Exchange& exchange) override {
    if (!greeted_) throw Refusal(v1::REASON_OUT_OF_TURN, "the first message must be `hello`");
    leave(exchange, grpc::Status::OK);
  }
  // The port is free again before the peer learns of its end, so that it may come back at once.
  void leave(Exchange& exchange, const grpc::Status& status) {
    leaving_.store(true);  // who sends lets go of the port
    exchange.post(Lane::work, [this, &exchange, status] {
      give_up_seat();
      exchange.finish(status);
    });
  }
  void on_done(Exchange& exchange, bool) override {
    parts_.runtime.lanes.post(Lane::work, exchange.caller().identity,
                              [self = exchange.shared_from_this(), this] { give_up_seat(); });
  }
  void give_up_seat() TS_EXCLUDES(mutex_) {
    std::unique_ptr<PeerSeat> seat;
    Timer::Id timer = 0;
    {
      Guard guard(mutex_);
      over_ = true;
      seat = std::move(seat_);
      timer = std::exchange(timer_, 0);
    }
    parts_.runtime.timer.cancel(timer);
  }

  // --- heartbeats
  void wait_for_beat() TS_REQUIRES(mutex_) {
    timer_ = parts_.runtime.timer.after(seat_->heart().period(),
                                        [this, weak = exchange_->weak_from_this()] {
                                          if (const auto self = weak.lock())
                                            self->guarded([&] { on_beat(); });
                                        });
  }
  void on_beat() TS_EXCLUDES(mutex_) {
    Guard guard(mutex_);
    if (!seat_) return;
    if (!seat_->heart().beat()) return exchange_->hang_up();
    wait_for_beat();
  }

  // --- the link
  bool send(const v1::ServerMessage& message, Clock::time_point deadline,
            const CancelToken& cancel) override {
    Patience patience(cancel);
    const auto gives_up = [&] { return leaving_.load() || patience.is_over(); };
    if (exchange_->write_by(serialized(message), deadline, gives_up)) return true;
    exchange_->hang_up();
    return false;
  }
  void refuse(const Refusal& refusal) override { leave(*exchange_, refusal.status()); }
  void beat(const v1::ServerMessage& message) override {
    if (exchange_->all_written()) exchange_->write(serialized(message));
  }

  const Parts& parts_;
  Exchange* exchange_ = nullptr;
  MemoryShare share_;  ///< of the message
  v1::PeerMessage message_;
  std::atomic<bool> greeted_{false}, leaving_{false};
  Mutex mutex_;
  std::unique_ptr<PeerSeat> seat_ TS_GUARDED_BY(mutex_);
  Timer::Id timer_ TS_GUARDED_BY(mutex_) = 0;
  bool over_ TS_GUARDED_BY(mutex_) = false;
};

}  // namespace

void add_coupling(Gate& gate, const Parts& parts) {
  gate.add("/mbcosim.v1.Coupling/Attach",
           stream(Role::control, [&parts] { return std::make_unique<AttachHandler>(parts); }));
}

}  // namespace mbcosim::server
