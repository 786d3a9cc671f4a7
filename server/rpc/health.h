/// grpc.health.v1: answered by the pollers, so that it waits behind nothing.
#pragma once

#include <functional>
#include <set>
#include <string>
#include <vector>

#include "rpc/exchange.h"
#include "rpc/places.h"

namespace mbcosim::server {

/// Thread-safe. Outlives the gate's server.
class Health {
 public:
  /// At once, of all callers and of those on one machine, who need not say who they are.
  static constexpr int kWatchers = 1024, kWatchersOfHost = kWatchers / 4;

  /// `services`: full names, besides "" for the server.
  explicit Health(std::vector<std::string> services)
      : services_(services.begin(), services.end()) {}
  /// `open`: no credentials are asked for.
  void add_to(Gate& gate, bool open);
  /// Tells watchers, once, that the server does not serve any more.
  void stop() TS_EXCLUDES(mutex_);

 private:
  class Check;
  class Watch;
  bool knows(const std::string& service) const {
    return service.empty() || services_.count(service) > 0;
  }
  /// A serialized HealthCheckResponse.
  grpc::ByteBuffer answer(const std::string& service) const TS_REQUIRES(mutex_);

  const std::set<std::string> services_;
  Places places_{kWatchersOfHost, kWatchers};  ///< of watchers, by host
  mutable Mutex mutex_;
  bool serving_ TS_GUARDED_BY(mutex_) = true;
  std::set<Watch*> watchers_ TS_GUARDED_BY(mutex_);
};

}  // namespace mbcosim::server
