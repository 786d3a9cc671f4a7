/// Where a stepping session and the stream of a peer meet.
#pragma once

#include <atomic>
#include <chrono>
#include <functional>
#include <optional>
#include <string>

#include "coupling/port_model.h"
#include "coupling/recorder.h"
#include "mbcosim/v1/coupling.pb.h"
#include "mbcosim/v1/simulations.pb.h"
#include "threads/alertness.h"
#include "threads/mutex.h"
#include "wire/refusal.h"

namespace mbcosim::server {

/// A peer that does not read holds up a step that is cancelled for a second at most.
class Patience {
 public:
  explicit Patience(const CancelToken& cancel) : cancel_(cancel) {}
  bool is_over() {
    if (!cancel_.cancelled()) return false;
    const auto now = std::chrono::steady_clock::now();
    if (!end_) end_ = now + std::chrono::seconds(1);
    return now >= *end_;
  }

 private:
  const CancelToken& cancel_;
  std::optional<std::chrono::steady_clock::time_point> end_;
};

/// Sends to one peer. Implemented over gRPC by the service, over a queue by tests.
class PeerLink {
 public:
  virtual ~PeerLink() = default;
  /// False: the peer is gone. Returns at `deadline` at the latest, and when the Patience with it is
  /// over, the link being broken then.
  virtual bool send(const v1::ServerMessage& message,
                    std::chrono::steady_clock::time_point deadline, const CancelToken& cancel) = 0;
  /// Sends a sign of life, unless other messages are on their way anyway.
  virtual void beat(const v1::ServerMessage&) {}
  /// May the session's thread fetch answers itself? That saves a change of threads.
  virtual bool pulls() const { return false; }
  enum class Pulled { message, nothing, closed };
  /// The next message, waiting for it until then at the latest.
  virtual Pulled pull(v1::PeerMessage*, std::chrono::steady_clock::time_point) {
    return Pulled::closed;
  }
  /// A pulled message broke the protocol, or the simulation has ended: ends the link with that
  /// status. Does not wait.
  virtual void refuse(const Refusal&) {}
};

/// A peer did not answer; the text tells why. The step fails with PEER_LOST.
struct PeerLost {
  std::string text;
};

/// A peer will not take part in a step of this length.
struct PeerRejected {
  std::string text;
  std::optional<double> preferred;  ///< length that it would take [s]
};

/// Thread-safe: the session's thread exchanges, the peer's thread attaches, delivers and detaches.
class Port {
 public:
  /// `longest_wait`: of policy WAIT. `recorder`: keeps what crosses the port; may be null, outlives
  /// the port.
  Port(PortModel model, std::chrono::milliseconds longest_wait, Recorder* recorder)
      : model_(std::move(model)), longest_wait_(longest_wait), recorder_(recorder) {}

  PortModel& model() { return model_; }
  const PortModel& model() const { return model_; }
  void fill(v1::PortLayout* out) const;
  /// For whom and since when the session waits; empty: for nobody.
  std::optional<v1::PortWait> waiting() const;

  // --- the peer's thread
  /// Takes the port for a peer. Throws PORT_TAKEN.
  void reserve(const Agreement& agreement);
  /// After `reserve`; exchanges may start. `welcome`: for the record.
  void attach(PeerLink* link, const v1::Welcome& welcome);
  void detach();
  /// The simulation has ended: so do the link of the peer and those of later ones.
  void end(const Refusal& why);
  /// How long the peer has sent nothing.
  std::chrono::steady_clock::duration silence() const;
  /// Any message after `hello`. Throws OUT_OF_TURN or what `deliver` throws.
  void receive(const v1::PeerMessage& message);
  /// Hands over an answer. Throws OUT_OF_TURN or BAD_ARGUMENT; answers to exchanges given up are
  /// dropped.
  void deliver(const v1::PeerExchange& answer);

  /// Calls `missed` with the reason whenever a step gets no answer. Before the first step.
  void set_on_missed(std::function<void(const std::string& why)> missed) {
    on_missed_ = std::move(missed);
  }

  // --- the session's thread, in this order within a step
  Agreement agreement() const;
  bool has_peer() const;
  /// Optional, and nobody has attached so far: the port takes no part in steps.
  bool is_idle() const;
  /// Has a peer ever attached?
  bool had_peer() const;
  /// One has, in an earlier process: the port takes part in steps. `left`: in what its answers are.
  void expect_peer(const Agreement& left);
  /// Waits until a peer is attached, as long as the policy says.
  void await_peer(const CancelToken& cancel);
  /// Sends what `model().fill` put into `message` for the peer of this handshake. Does not throw:
  /// `take` tells.
  void send(v1::ServerMessage& message, int generation, const CancelToken& cancel);
  /// The answer to the last `send`, or nothing when the policy goes on without. Throws PeerLost,
  /// PeerRejected.
  std::optional<Answer> take(const CancelToken& cancel);
  bool is_waiting() const;  ///< was a message sent whose answer was not taken?
  void forget();            ///< gives up the answer that is on its way
  /// Tells the peer how an implicit step ended.
  void notify(bool accepted, std::int64_t step, double time, const CancelToken& cancel);

 private:
  using Clock = std::chrono::steady_clock;
  template <class Use>
  void use_link(Use&& use) TS_REQUIRES(mutex_);
  void send_message(const v1::ServerMessage& message, const CancelToken& cancel)
      TS_REQUIRES(mutex_);
  void look_for_answer() TS_EXCLUDES(mutex_);
  bool pull() TS_REQUIRES(mutex_);
  Answer take_content(const v1::PeerExchange& exchange) TS_REQUIRES(mutex_);
  void check_rejection(const v1::Rejection& rejection) const;
  [[noreturn]] void lose(const std::string& why);
  std::string why_gone() const TS_REQUIRES(mutex_);
  std::optional<Answer> go_on_without(const std::string& why) TS_REQUIRES(mutex_);

  PortModel model_;
  const std::chrono::milliseconds longest_wait_;
  Recorder* const recorder_;
  std::function<void(const std::string&)> on_missed_;
  mutable Mutex mutex_;  // protects `model_`, too, while an answer is decoded
  Condition changed_;
  Agreement agreement_ TS_GUARDED_BY(mutex_);
  bool reserved_ TS_GUARDED_BY(mutex_) = false, link_in_use_ TS_GUARDED_BY(mutex_) = false;
  PeerLink* link_ TS_GUARDED_BY(mutex_) = nullptr;
  std::int64_t index_ TS_GUARDED_BY(mutex_) = 0;     ///< of the last exchange on the present stream
  bool awaited_ TS_GUARDED_BY(mutex_) = false;       ///< its answer is wanted
  v1::PeerExchange received_ TS_GUARDED_BY(mutex_);  ///< what `answer_` was made of, for the record
  std::optional<Answer> answer_ TS_GUARDED_BY(mutex_);
  std::string peer_failure_ TS_GUARDED_BY(mutex_);  ///< the peer could not compute
  bool had_peer_ TS_GUARDED_BY(mutex_) = false;
  std::string refused_ TS_GUARDED_BY(mutex_);  ///< why its last message was refused
  std::optional<PeerRejected> rejection_ TS_GUARDED_BY(mutex_);
  std::optional<Refusal> ended_ TS_GUARDED_BY(mutex_);
  std::optional<Clock::time_point> waiting_since_ TS_GUARDED_BY(mutex_);
  std::atomic<Clock::rep> heard_{0};  ///< when the peer last sent something
  v1::PeerMessage pulled_;            ///< of the session's thread, as is the next
  Alertness for_answer_;
};

}  // namespace mbcosim::server
