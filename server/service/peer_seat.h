/// One peer on one port, from its hello to its end, whatever carries the messages.
#pragma once

#include <optional>

#include "coupling/port.h"
#include "service/parts.h"

namespace mbcosim::server {

/// Signs of life: when to send one, and whether the peer has been silent for too long. Passive: who
/// owns it calls `beat` at the times that it tells.
class Heart {
 public:
  using Clock = std::chrono::steady_clock;
  Heart(PeerLink& link, const Port& port, const Agreement& agreement);
  bool needed() const { return beats() || agreement_.heartbeat_timeout > kNever; }
  /// How long to wait before the next `beat`.
  Clock::duration period() const;
  /// Sends what is due. False: the peer has been silent for too long.
  bool beat();

 private:
  static constexpr std::chrono::milliseconds kNever{0};
  bool beats() const { return agreement_.heartbeat_interval > kNever; }

  PeerLink& link_;
  const Port& port_;
  const Agreement agreement_;
  Clock::time_point next_;
  std::int64_t count_ = 0;
};

/// Keeps the port taken and the session alive.
class PeerSeat {
 public:
  /// Settles what `hello` asks for. Throws Refusal, CANCELLED when the call ends first.
  PeerSeat(const Parts& parts, const v1::Hello& hello, const Caller& caller, Call& call,
           PeerLink& link);
  /// Waits for the end of a message that the session sends.
  ~PeerSeat();
  PeerSeat(const PeerSeat&) = delete;
  PeerSeat& operator=(const PeerSeat&) = delete;

  const v1::ServerMessage& welcome() const { return welcome_; }
  /// After the welcome was sent: exchanges may start.
  void begin();
  /// Any message after `hello`. Throws Refusal, NOT_GRANTED when the grant was taken back.
  void receive(const v1::PeerMessage& message);
  Heart& heart() { return *heart_; }

 private:
  const Parts& parts_;
  const Caller caller_;
  const SessionHold session_;
  PeerLink& link_;
  Port& port_;
  v1::ServerMessage welcome_;
  std::optional<Heart> heart_;
};

}  // namespace mbcosim::server
