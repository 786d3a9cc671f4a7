/// Clients that hold all workers of the door and ask for nothing.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <set>
#include <thread>

#include "http/sockets.h"
#include "threads/mutex.h"

namespace mbcosim::server::http {

/// A connection holds a worker while its client sends the head of a request, its body, or nothing,
/// and while it does not read its answer. When such and others hold all workers, those without a
/// whole request and those that stand still are shut down, the longest idle first, as many as wait
/// for a worker: they delay others by tenths of a second, not by their own timeouts.
class Crowd {
 public:
  using Clock = std::chrono::steady_clock;

  explicit Crowd(int workers);
  ~Crowd();
  Crowd(const Crowd&) = delete;
  Crowd& operator=(const Crowd&) = delete;

  /// Where the door listens; before it is known, nobody is shut down.
  void listens_at(const Endpoint& local);
  /// A worker takes a connection, or lets it go.
  void came();
  void went();
  /// A request begins, or one that had begun ends or lacks the rest of its body; `socket` -1: one
  /// that could not be found.
  void began(int socket);
  void ended(int socket);
  /// The client does not read its answer, whatever it sends meanwhile; it does again.
  void stands(int socket);
  void goes_on(int socket);
  /// Of a body, or of an answer, another `kProgress` bytes have come: who does so often is not
  /// idle.
  static constexpr std::size_t kProgress = 32 << 10;
  void moves(int socket);
  /// The door closes: nobody is let in, and who asks for nothing is shut down. The library's
  /// threads would look for that once in two seconds.
  void dismiss();

 private:
  void loop();
  void thin_out() TS_REQUIRES(mutex_);
  bool is_ours(int socket) const TS_REQUIRES(mutex_);  ///< or the door's own

  const std::size_t workers_;
  Mutex mutex_;
  Condition changed_;
  Endpoint local_ TS_GUARDED_BY(mutex_);
  std::size_t held_ TS_GUARDED_BY(mutex_) = 0;
  std::multiset<int> in_request_ TS_GUARDED_BY(mutex_);
  std::set<int> standing_ TS_GUARDED_BY(mutex_);  ///< sockets
  /// By cookie: since when a socket is seen with nothing to read and no request, or stands.
  std::map<std::uint64_t, Clock::time_point> idle_ TS_GUARDED_BY(mutex_);
  std::map<int, Clock::time_point> moved_ TS_GUARDED_BY(mutex_);  ///< of sockets
  bool stop_ TS_GUARDED_BY(mutex_) = false;
  std::thread thread_;
};

}  // namespace mbcosim::server::http
