#include "service/coupling_service.h"

#include <algorithm>
#include <condition_variable>
#include <mutex>
#include <thread>

#include "coupling/handshake.h"

namespace mbcosim::server {
namespace {

constexpr auto kHandshake = std::chrono::seconds(10);  // longest wait for its next message

/// Over gRPC; a peer that does not read until the deadline loses its stream.
class GrpcStream : public PeerStream {
 public:
  GrpcStream(CouplingService::Stream* stream, Call& call) : stream_(stream), call_(call) {}
  bool read(v1::PeerMessage* message) override { return stream_->Read(message); }
  bool send(const v1::ServerMessage& message,
            std::chrono::steady_clock::time_point deadline) override {
    call_.set_deadline(deadline);
    const bool sent = stream_->Write(message);
    call_.clear_deadline();
    return sent;
  }
  void hang_up() override { call_.hang_up(); }

 private:
  CouplingService::Stream* stream_;
  Call& call_;
};

/// The session's exchanges and the heartbeats of one stream, one message at a time.
class TurnTaker : public PeerLink {
 public:
  using Clock = std::chrono::steady_clock;
  explicit TurnTaker(PeerStream& stream) : stream_(stream) {}
  bool send(const v1::ServerMessage& message, Clock::time_point deadline) override {
    std::unique_lock guard(mutex_);
    if (!free_.wait_until(guard, deadline, [&] { return !busy_; })) return false;
    busy_ = true;
    guard.unlock();
    const bool sent = stream_.send(message, deadline);
    guard.lock();
    busy_ = false;
    guard.unlock();
    free_.notify_one();
    return sent;
  }
  bool pulls() const override { return stream_.pulls(); }
  Pulled pull(v1::PeerMessage* message, Clock::time_point until) override {
    return stream_.pull(message, until);
  }
  void refuse(const Refusal& refusal) override { stream_.refuse(refusal); }

 private:
  PeerStream& stream_;
  std::mutex mutex_;   // protects the one below
  bool busy_ = false;  ///< somebody sends
  std::condition_variable free_;
};

/// Sends `heartbeat` at an even pace and listens for the peer's, from a thread of its own, whatever
/// the simulation does.
class Heart {
 public:
  Heart(TurnTaker& link, PeerStream& stream, const Port& port, const Agreement& agreement)
      : link_(link), stream_(stream), port_(port), agreement_(agreement) {
    if (beats() || agreement.heartbeat_timeout > kNever) thread_ = std::thread([this] { run(); });
  }
  ~Heart() {
    {
      std::lock_guard guard(mutex_);
      stop_ = true;
    }
    changed_.notify_one();
    if (thread_.joinable()) thread_.join();
  }
  Heart(const Heart&) = delete;
  Heart& operator=(const Heart&) = delete;

 private:
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::milliseconds kNever{0}, kLongestSend{500};
  bool beats() const { return agreement_.heartbeat_interval > kNever; }

  void run() {
    const auto timeout = agreement_.heartbeat_timeout;
    const auto listen =
        std::max<std::chrono::milliseconds>(timeout / 4, std::chrono::milliseconds(1));
    const auto period = beats() && (timeout == kNever || agreement_.heartbeat_interval < listen)
                            ? agreement_.heartbeat_interval
                            : listen;
    Clock::time_point next = Clock::now() + agreement_.heartbeat_interval;
    v1::ServerMessage message;
    std::unique_lock guard(mutex_);
    while (!changed_.wait_for(guard, period, [&] { return stop_; })) {
      guard.unlock();
      if (timeout > kNever && port_.silence() > timeout) return stream_.hang_up();
      if (beats() && Clock::now() >= next) {
        message.mutable_heartbeat()->set_count(++count_);
        if (!link_.send(message, Clock::now() + kLongestSend) && timeout == kNever) return;
        next += agreement_.heartbeat_interval;
      }
      guard.lock();
    }
  }

  TurnTaker& link_;
  PeerStream& stream_;
  const Port& port_;
  const Agreement agreement_;
  std::int64_t count_ = 0;
  std::mutex mutex_;  // protects the one below
  bool stop_ = false;
  std::condition_variable changed_;
  std::thread thread_;
};

/// Keeps the port taken while it lives.
class Attachment {
 public:
  Attachment(Port& port, const Agreement& agreement) : port_(port) { port_.reserve(agreement); }
  ~Attachment() { port_.detach(); }
  Attachment(const Attachment&) = delete;
  Attachment& operator=(const Attachment&) = delete;

 private:
  Port& port_;
};

}  // namespace

grpc::Status CouplingService::Attach(grpc::ServerContext* context, Stream* stream) {
  return server::serve(parts_, *context, "Attach", Role::control, [&](const Caller& caller) {
    Call call(parts_.watch, *context);
    GrpcStream peer(stream, call);
    serve(peer, caller);
  });
}

void CouplingService::serve(PeerStream& stream, const Caller& caller) {
  v1::PeerMessage first;
  if (!stream.read(&first) || !first.has_hello())
    throw Refusal(v1::REASON_OUT_OF_TURN, "the first message must be `hello`");
  const SessionPtr session = parts_.store.get(first.hello().simulation(), caller);
  const Session::Use use(*session);
  serve_peer(first.hello(), *session, stream);
}

void CouplingService::serve_peer(const v1::Hello& hello, Session& session, PeerStream& stream) {
  Port& port = session.port(hello.port());
  v1::SimulationInfo info;
  session.fill(&info);
  const Agreement agreement = agree(hello, port.model(), info.model_digest(), info.next_step_s());
  TurnTaker link(stream);
  const Attachment attachment(port, agreement);
  v1::ServerMessage message;
  v1::Welcome* welcome = message.mutable_welcome();
  welcome->set_protocol_version(kProtocolVersion);
  port.fill(welcome->mutable_layout());
  welcome->set_model_digest(info.model_digest());
  welcome->set_step_size_s(info.next_step_s());
  welcome->set_step(info.step());
  welcome->set_time_s(info.time_s());
  fill_agreed(hello, agreement, welcome->mutable_agreed());
  if (!stream.send(message, std::chrono::steady_clock::now() + kHandshake)) return;
  port.attach(&link, *welcome);
  const Heart heart(link, stream, port, agreement);
  v1::PeerMessage in;
  while (stream.read(&in)) port.receive(in);
}

}  // namespace mbcosim::server
