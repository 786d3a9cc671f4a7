/// How many calls have come, over which connection.
#pragma once

#include <algorithm>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "threads/mutex.h"

namespace mbcosim::server {

/// By connection, as gRPC names it. Thread-safe.
class CallCounts {
 public:
  using Counts = std::map<std::string, int>;

  void add(const std::string& connection) TS_EXCLUDES(mutex_) {
    Guard guard(mutex_);
    ++counts_[connection];
  }
  /// Since it was asked last.
  Counts take() TS_EXCLUDES(mutex_) {
    Guard guard(mutex_);
    return std::exchange(counts_, {});
  }

 private:
  Mutex mutex_;
  Counts counts_ TS_GUARDED_BY(mutex_);
};

/// Has the connection a name of its own? Those of Unix sockets share one.
inline bool is_told_apart(const std::string& connection) {
  return connection.compare(0, 5, "ipv4:") == 0 || connection.compare(0, 5, "ipv6:") == 0;
}

/// Those that have at least half as many as the busiest one; a name that many share only when it is
/// the busiest.
inline std::vector<std::string> busiest(const CallCounts::Counts& counts) {
  const auto most = std::max_element(counts.begin(), counts.end(),
                                     [](auto& a, auto& b) { return a.second < b.second; });
  std::vector<std::string> found;
  for (const auto& [connection, count] : counts)
    if (connection == most->first || (is_told_apart(connection) && 2 * count >= most->second))
      found.push_back(connection);
  return found;
}

}  // namespace mbcosim::server
