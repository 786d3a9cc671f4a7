/// Internal to the client library: calls that are made again while the server cannot be reached.
#pragma once

#include <algorithm>
#include <chrono>
#include <optional>
#include <string>
#include <thread>

#include "client/connection.h"

namespace mbcosim::client {

/// Did the call get lost on its way? gRPC answers one that comes while its server is being shut
/// down with CANCELLED and the code's name as text; nothing has been done then.
inline bool is_lost(const grpc::Status& status) {
  return status.error_code() == grpc::StatusCode::UNAVAILABLE ||
         (status.error_code() == grpc::StatusCode::CANCELLED &&
          status.error_message() == "CANCELLED");
}

/// The attempts of one call: as many as come into the connection's `reconnect` seconds, by which
/// the bound on the call grows.
class Attempts {
 public:
  Attempts(const Server::Impl& server, double timeout) : server_(server) {
    if (checked_timeout(timeout) != kEndless)
      latest_ = Clock::now() + duration(std::min(timeout + server.reconnect, kLongest));
  }
  /// Of the bound [s]; kEndless: there is none.
  double left() const {
    if (!latest_) return kEndless;
    return std::max(std::chrono::duration<double>(*latest_ - Clock::now()).count(), 1e-3);
  }
  /// Was the call lost on its way, and is there time for another? Waits a while, and until the
  /// server is there.
  bool again(const grpc::Status& status) {
    if (!is_lost(status) || server_.reconnect <= 0) return false;
    const Clock::time_point now = Clock::now();
    if (!end_) end_ = now + duration(server_.reconnect);
    if (now >= *end_) return false;
    std::this_thread::sleep_for(std::min<Clock::duration>(pause_, *end_ - now));
    pause_ = std::min(2 * pause_, kLongestPause);
    server_.channel->WaitForConnected(std::chrono::system_clock::now() + (*end_ - Clock::now()));
    return true;
  }

 private:
  using Clock = std::chrono::steady_clock;
  static constexpr double kLongest = 1e9;  // of timeouts [s]
  static constexpr std::chrono::milliseconds kLongestPause{1000};
  static Clock::duration duration(double seconds) {
    return std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
  }

  const Server::Impl& server_;
  std::optional<Clock::time_point> latest_, end_;
  std::chrono::milliseconds pause_{50};
};

/// `call` gets the context of an attempt and gives its status. It must be one that may be repeated.
/// Throws Error.
template <class Call>
void repeated(const Server::Impl& server, double timeout, const std::string& simulation,
              Call call) {
  Attempts attempts(server, timeout);
  grpc::Status status;
  do {
    CallContext context(server, attempts.left(), simulation);
    status = call(context);
  } while (attempts.again(status));
  require(status);
}

}  // namespace mbcosim::client
