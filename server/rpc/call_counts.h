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

/// Those that have at least half as many as the busiest one. All connections of Unix sockets share
/// one name, which counts only when nothing else is busier.
inline std::vector<std::string> busiest(const CallCounts::Counts& counts) {
  const auto most = std::max_element(counts.begin(), counts.end(),
                                     [](auto& a, auto& b) { return a.second < b.second; });
  std::vector<std::string> found;
  for (const auto& [connection, count] : counts) {
    const bool is_unix = connection.compare(0, 5, "unix:") == 0;
    if (connection == most->first || (!is_unix && 2 * count >= most->second))
      found.push_back(connection);
  }
  return found;
}

}  // namespace mbcosim::server
