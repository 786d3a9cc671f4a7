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
/// and while it does not read its answer. When such and others hold all workers, those that wait
/// for their clients are shut down, the longest idle first, as many as wait for a worker: they
/// delay others by tenths of a second, not by their own timeouts. One without the head of a request
/// is shut down after `kHeadTime` in any case.
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
  static constexpr std::chrono::seconds kHeadTime{5};
  /// A request begins, its head being there, or ends; `socket` -1: one that could not be found.
  void began(int socket);
  void ended(int socket);
  /// Within a request: for the rest of its body, or for the client to read its answer. No longer.
  void waits(int socket);
  void goes_on(int socket);
  /// Of a body, or of an answer, another `kProgress` bytes have come: who does so often is not
  /// idle.
  static constexpr std::int64_t kProgress = 32 << 10;
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
  std::multiset<int> in_request_ TS_GUARDED_BY(mutex_);  ///< sockets
  std::multiset<int> waiting_ TS_GUARDED_BY(mutex_);     ///< of `in_request_`
  /// By cookie: since when a socket is seen to wait, or with nothing to read and no request.
  std::map<std::uint64_t, Clock::time_point> idle_ TS_GUARDED_BY(mutex_);
  std::map<int, Clock::time_point> moved_ TS_GUARDED_BY(mutex_);  ///< of sockets, the last time
  bool rests_ TS_GUARDED_BY(mutex_) = false;                      ///< the thread, until it is woken
  bool stop_ TS_GUARDED_BY(mutex_) = false;
  std::thread thread_;
};

}  // namespace mbcosim::server::http
