/// All simulations of a daemon.
#pragma once

#include <condition_variable>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "service/auth.h"
#include "service/session.h"

namespace mbcosim::server {

using SessionPtr = std::shared_ptr<Session>;

/// Thread-safe. Closes sessions whose lease is over.
class SessionStore {
 public:
  SessionStore(const ServiceLimits& limits, Metrics& metrics);
  ~SessionStore();

  /// A place for one more session, taken before the work of creating it starts.
  class Place {
   public:
    explicit Place(SessionStore& store);  ///< throws Refusal when all places are taken
    ~Place();
    Place(const Place&) = delete;
    Place& operator=(const Place&) = delete;

   private:
    SessionStore& store_;
  };

  /// The session that the caller created earlier with this request id, or null.
  SessionPtr find_request(const std::string& request_id, const Caller& caller) const;
  void add(SessionPtr session);
  /// Throws NOT_FOUND; other people's sessions are not found either.
  SessionPtr get(const std::string& id, const Caller& caller) const;
  std::vector<SessionPtr> list(const Caller& caller) const;  ///< in the order of creation
  void remove(const std::string& id, const Caller& caller);
  void close_all();

  static std::string new_id();

 private:
  void watch_leases();
  void close_expired();

  const ServiceLimits& limits_;
  Metrics& metrics_;
  mutable std::mutex mutex_;
  std::map<std::string, SessionPtr> sessions_;
  std::vector<std::string> order_;
  int places_ = 0;
  bool stop_ = false;
  std::condition_variable stop_signal_;
  std::thread lease_thread_;
};

}  // namespace mbcosim::server
