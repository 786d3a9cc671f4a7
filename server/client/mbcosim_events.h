/// What happens to simulations, whoever makes it happen.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <variant>

namespace mbcosim::client {

/// Something that happened.
struct Event {
  /// Events are not there any more: the reader was too slow, or away for too long.
  struct Missed {
    std::optional<std::int64_t> count;  ///< none: the server was started anew
  };
  struct Created {
    std::string display_name, forked_from;
  };
  struct Deleted {
    bool lease_over = false;  ///< nobody used it; else somebody asked for it
  };
  /// Ready again after it was finished or failed, finished, failed or suspended.
  struct StateChanged {
    std::string state;  ///< "READY", "FINISHED", "FAILED", "SUSPENDED"
    std::int64_t step = 0;
  };
  struct StepFailed {
    std::string outcome;  ///< "NOT_CONVERGED", …
    std::string message;
    std::int64_t step = 0;
  };
  struct Peer {
    enum Change { unknown, attached, left, late };
    Change change = unknown;
    std::string port, identity;
  };
  struct Snapshot {
    enum Change { unknown, saved, restored, deleted };
    Change change = unknown;
    std::string name;
    std::int64_t step = 0;
  };
  struct LeaseEnding {
    double seconds_left = 0;
  };
  struct CheckpointWritten {
    std::int64_t step = 0;
    std::int64_t bytes = 0;  ///< snapshots and journals apart
  };
  struct CheckpointFailed {
    std::string message;
  };
  /// Of a kind that is newer than this library.
  struct Unknown {};

  std::optional<std::int64_t> sequence;  ///< none: `Missed`
  std::chrono::system_clock::time_point time;
  std::string simulation;
  std::string identity, method, trace_id;  ///< of who made it happen; empty: the server
  std::variant<Unknown, Missed, Created, Deleted, StateChanged, StepFailed, Peer, Snapshot,
               LeaseEnding, CheckpointFailed, CheckpointWritten>
      content;
};

/// Where a watcher has come: another one goes on from there.
struct EventPlace {
  std::string journal;               ///< the series of numbers that a start of the server begins
  std::optional<std::int64_t> last;  ///< number of the last event seen
};

/// Events as they come. Ends when it is destroyed. One thread reads.
class Events {
 public:
  struct Impl;  // of the library

  Events(Events&&) noexcept;
  Events& operator=(Events&&) noexcept;
  ~Events();
  /// Waits for the next event; false: the simulation is gone or `close` was called. Throws Error.
  bool next(Event& event);
  EventPlace place() const;
  void close();  ///< from any thread

 private:
  friend class Server;
  explicit Events(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace mbcosim::client
