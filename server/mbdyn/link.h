/// Bytes to and from an external code, with every wait bounded.
#pragma once

#include <chrono>
#include <cstdio>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>

#include "model/deck_channel.h"

namespace mbcosim::mbdyn {

/// The code is gone, silent, or speaks another language. The text names it.
class ChannelLost : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

using Clock = std::chrono::steady_clock;

/// How long a wait may be, what ends it before, and who hears of what does not end a run.
struct Patience {
  std::chrono::milliseconds time{60000};
  std::chrono::milliseconds farewell{1000};  ///< for all codes of a run to hear of its end
  std::function<bool()> cancelled = [] { return false; };
  std::function<void(const std::string&)> warn = [](const std::string& text) {
    std::fprintf(stderr, "warning: %s\n", text.c_str());
  };
};

/// A connected stream socket. Throws ChannelLost; the texts begin with `name`.
class Link {
 public:
  /// Owns the descriptor.
  Link(int descriptor, std::string name, Patience patience);
  ~Link();
  Link(const Link&) = delete;
  Link& operator=(const Link&) = delete;

  const std::string& name() const { return name_; }
  void warn(const std::string& text) const { patience_.warn(text); }
  void set_patience(std::chrono::milliseconds time) { patience_.time = time; }
  /// Sends all.
  void send(const std::string& bytes);
  /// Sends all at once or nothing: false when there is no room.
  bool send_if_room(const std::string& bytes);
  /// Waits for so many bytes.
  std::string receive(std::size_t size);
  /// Takes what is there, after the first `done` bytes of a message; true: it is whole.
  bool receive_at_once(std::string& message, std::size_t& done);
  /// Sends no more and drops what still comes until the peer closes, at most for so long: what was
  /// sent last then arrives.
  void finish(std::chrono::milliseconds time) noexcept;

 private:
  void await(short events, Clock::time_point end) const;
  int descriptor_;
  std::string name_;
  Patience patience_;
};

/// A socket that waits for its peer. The path of a Unix socket is removed at the end.
class Listener {
 public:
  /// Binds; throws ChannelLost when the address is taken or not ours. `backlog`: peers that may
  /// have connected before they are accepted.
  Listener(const ChannelAddress& address, std::string name, int backlog = 1);
  ~Listener();
  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;
  /// The first peer that comes before `end`.
  std::unique_ptr<Link> accept(Clock::time_point end, const Patience& patience);
  /// A peer that waits; null: nobody does.
  std::unique_ptr<Link> accept_if_any(const Patience& patience);

 private:
  int descriptor_ = -1;
  std::string path_, name_;
};

/// Connects; tries again every 0.1 s until `end` while nobody listens.
std::unique_ptr<Link> connect_to(const ChannelAddress& address, const std::string& name,
                                 Clock::time_point end, const Patience& patience);

/// "/tmp/x.sock", "localhost:9011"
std::string text_of(const ChannelAddress& address);

}  // namespace mbcosim::mbdyn
