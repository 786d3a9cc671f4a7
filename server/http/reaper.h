/// Ends connections that take too long: whoever sends or reads byte by byte holds no thread for
/// ever.
#pragma once

#include <chrono>
#include <map>
#include <thread>

#include "threads/mutex.h"

namespace mbcosim::server::http {

/// Shuts a socket down when its time is over; the thread that reads or writes it then sees its end.
class Reaper {
 public:
  using Clock = std::chrono::steady_clock;

  Reaper();
  ~Reaper();
  Reaper(const Reaper&) = delete;
  Reaper& operator=(const Reaper&) = delete;

  /// Replaces the time that the socket had. The caller disarms before the socket is closed.
  void arm(int socket, std::chrono::milliseconds time);
  void disarm(int socket);
  /// Nobody, later ones included, has more time than this from now on.
  void hurry(std::chrono::milliseconds time);

 private:
  void loop();

  Mutex mutex_;
  Condition changed_;
  std::map<int, Clock::time_point> deadlines_ TS_GUARDED_BY(mutex_);  ///< by socket
  Clock::time_point end_ TS_GUARDED_BY(mutex_) = Clock::time_point::max();
  bool stop_ TS_GUARDED_BY(mutex_) = false;
  bool rests_ TS_GUARDED_BY(mutex_) = false;  ///< the thread, until it is woken
  std::thread thread_;
};

}  // namespace mbcosim::server::http
