/// Clients that reset their calls faster than any has a reason to.
#pragma once

#include <chrono>
#include <map>
#include <string>

#include "threads/mutex.h"

namespace mbcosim::server {

/// Counts the calls that each connection has reset. A stream that its client resets is none to
/// HTTP/2 any more, so that gRPC takes the next one at once, with no bound on how many wait for
/// their turn here ("rapid reset", CVE-2023-44487). Thread-safe.
class Resets {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr int kMost = 2000;  ///< in one second, over one connection

  /// One more. True: these are `kMost` of this second, or twice, three times as many.
  bool are_too_many(const std::string& connection, Clock::time_point now) TS_EXCLUDES(mutex_);

 private:
  struct Count {
    Clock::time_point second;
    int resets = 0;
  };
  void forget_before(Clock::time_point second) TS_REQUIRES(mutex_);

  Mutex mutex_;
  std::map<std::string, Count> counts_ TS_GUARDED_BY(mutex_);
  Clock::time_point forgot_ TS_GUARDED_BY(mutex_){};
};

}  // namespace mbcosim::server
