#include "service/session_store.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <cstdio>
#include <random>

#include "wire/refusal.h"

namespace mbcosim::server {

SessionStore::SessionStore(const ServiceLimits& limits, Metrics& metrics)
    : limits_(limits), metrics_(metrics), lease_thread_([this] { watch_leases(); }) {}

SessionStore::~SessionStore() {
  {
    std::lock_guard guard(mutex_);
    stop_ = true;
  }
  stop_signal_.notify_one();
  lease_thread_.join();
}

std::string SessionStore::new_id() {
  std::random_device random;
  char text[40];
  std::snprintf(text, sizeof text, "simulations/%08x%08x", random(), random());
  return text;
}

SessionStore::Place::Place(SessionStore& store) : store_(store) {
  std::lock_guard guard(store_.mutex_);
  if (static_cast<int>(store_.sessions_.size()) + store_.places_ >= store_.limits_.sessions)
    throw limit_refusal("sessions", store_.limits_.sessions,
                        "the server has as many simulations as are allowed");
  ++store_.places_;
}

SessionStore::Place::~Place() {
  std::lock_guard guard(store_.mutex_);
  --store_.places_;
}

SessionPtr SessionStore::find_request(const std::string& request_id, const Caller& caller) const {
  if (request_id.empty()) return nullptr;
  std::lock_guard guard(mutex_);
  for (const auto& [id, session] : sessions_) {
    const Session::Identity& identity = session->identity();
    if (identity.request_id == request_id && identity.owner == caller.identity) return session;
  }
  return nullptr;
}

void SessionStore::add(SessionPtr session) {
  std::lock_guard guard(mutex_);
  const std::string id = session->identity().id;
  spdlog::info("{} created for {}", id, session->identity().owner);
  order_.push_back(id);
  sessions_.emplace(id, std::move(session));
  metrics_.count_created();
  metrics_.set_sessions(static_cast<int>(sessions_.size()));
}

SessionPtr SessionStore::get(const std::string& id, const Caller& caller) const {
  std::lock_guard guard(mutex_);
  const auto found = sessions_.find(id);
  if (found == sessions_.end() || !caller.may_touch(found->second->identity().owner))
    throw Refusal(v1::REASON_NO_SUCH_SIMULATION,
                  "no simulation is named \"" + id.substr(0, 100) + "\"");
  return found->second;
}

std::vector<SessionPtr> SessionStore::list(const Caller& caller) const {
  std::lock_guard guard(mutex_);
  std::vector<SessionPtr> result;
  for (const std::string& id : order_) {
    const SessionPtr& session = sessions_.at(id);
    if (caller.may_touch(session->identity().owner)) result.push_back(session);
  }
  return result;
}

void SessionStore::remove(const std::string& id, const Caller& caller) {
  const SessionPtr session = get(id, caller);
  session->close();
  std::lock_guard guard(mutex_);
  if (sessions_.erase(id) == 0) return;
  std::erase(order_, id);
  metrics_.set_sessions(static_cast<int>(sessions_.size()));
  spdlog::info("{} deleted", id);
}

void SessionStore::close_all() {
  std::lock_guard guard(mutex_);
  for (const auto& [id, session] : sessions_) session->close();
}

void SessionStore::close_expired() {
  std::vector<SessionPtr> expired;
  {
    std::lock_guard guard(mutex_);
    const auto now = std::chrono::steady_clock::now();
    for (const auto& [id, session] : sessions_)
      if (session->lease().expire(now)) expired.push_back(session);
  }
  for (const SessionPtr& session : expired) {
    spdlog::info("{}: lease over", session->identity().id);
    remove(session->identity().id, Caller{"", Role::admin});
  }
}

void SessionStore::watch_leases() {
  std::unique_lock guard(mutex_);
  while (!stop_signal_.wait_for(guard, std::chrono::milliseconds(200), [&] { return stop_; })) {
    guard.unlock();
    close_expired();
    guard.lock();
  }
}

}  // namespace mbcosim::server
