#include "service/session_store.h"

#include <algorithm>

#include "threads/top_frame.h"
#include "wire/convert.h"
#include "wire/refusal.h"

namespace mbcosim::server {

SessionStore::SessionStore(const ServiceLimits& limits, EventLog& log)
    : limits_(limits), log_(log), lease_thread_([this] { watch_leases(); }) {}

SessionStore::~SessionStore() {
  {
    Guard guard(mutex_);
    stop_ = true;
  }
  changed_.notify_all();
  lease_thread_.join();
}

// ------------------------------------------------------------------ creations

SessionStore::Place::Place(SessionStore& store, const std::string& request_id, std::uint64_t digest,
                           const Caller& caller, const Call& call)
    : store_(store), request_(caller.identity, request_id) {
  check_request_id(request_id);
  constexpr std::chrono::milliseconds kLook(20);  // how soon the end of the call is noticed
  Guard guard(store_.mutex_);
  if (!request_id.empty()) {
    while (store_.creations_.count(request_) > 0 && !call.cancelled())
      store_.changed_.wait_for(store_.mutex_, kLook);
    if (call.cancelled()) throw Refusal(v1::REASON_CANCELLED, "the call was cancelled");
    known_ = store_.find_request(request_);
    if (known_ && known_->identity().request_digest != digest) refuse_other_request(request_id);
    if (known_) {
      store_.repeated_.insert(known_->identity().id);
      return;
    }
  }
  store_.check_room(caller.identity);
  store_.places_.insert(caller.identity);
  if (!request_id.empty()) store_.creations_.insert(request_);
}

SessionStore::Place::~Place() {
  if (known_) return;
  Guard guard(store_.mutex_);
  store_.places_.erase(store_.places_.find(request_.first));
  store_.creations_.erase(request_);
  store_.changed_.notify_all();
}

void SessionStore::check_room(const std::string& owner) const {
  if (static_cast<int>(sessions_.size() + places_.size()) >= limits_.sessions)
    throw limit_refusal("sessions", limits_.sessions,
                        "the server has as many simulations as are allowed");
  const auto own = std::count_if(sessions_.begin(), sessions_.end(), [&](const auto& entry) {
    return entry.second->identity().owner == owner;
  });
  if (own + static_cast<std::ptrdiff_t>(places_.count(owner)) >= limits_.identity_sessions)
    throw limit_refusal("identity_sessions", limits_.identity_sessions,
                        owner + " has as many simulations as one identity may have");
}

SessionPtr SessionStore::find_request(const Request& request) const {
  for (const auto& [id, session] : sessions_) {
    const Session::Identity& identity = session->identity();
    if (identity.owner == request.first && identity.request_id == request.second) return session;
  }
  return nullptr;
}

// ------------------------------------------------------------------ sessions

void SessionStore::add(SessionPtr session) {
  Guard guard(mutex_);
  const std::string id = session->identity().id;
  order_.push_back(id);
  sessions_.emplace(id, std::move(session));
}

SessionPtr SessionStore::get(const std::string& id, const Caller& caller, Call& call, Access access,
                             const std::string& port) const {
  if (!has(id) && keeper_.wake) (void)keeper_.wake(id, caller, call);
  Guard guard(mutex_);
  SessionPtr session = find(id, caller, access, port);
  if (!session) refuse_unknown(id);
  return session;
}

SessionPtr SessionStore::get_alive(const std::string& id, const Caller& caller,
                                   Access access) const {
  Guard guard(mutex_);
  return find(id, caller, access, "");
}

// Null: it is not alive, or the caller may not see it.
SessionPtr SessionStore::find(const std::string& id, const Caller& caller, Access access,
                              const std::string& port) const {
  const auto found = sessions_.find(id);
  if (found == sessions_.end()) return nullptr;
  const Grants& grants = found->second->grants();
  if (!grants.allow(caller, Access::see)) return nullptr;
  grants.require(id, caller, access, port);
  return found->second;
}

bool SessionStore::has(const std::string& id) const {
  Guard guard(mutex_);
  return sessions_.count(id) > 0;
}

std::vector<SessionPtr> SessionStore::all() const {
  Guard guard(mutex_);
  std::vector<SessionPtr> result;
  for (const std::string& id : order_) result.push_back(sessions_.at(id));
  return result;
}

std::vector<SessionPtr> SessionStore::list(const Caller& caller) const {
  Guard guard(mutex_);
  std::vector<SessionPtr> result;
  for (const std::string& id : order_) {
    const SessionPtr& session = sessions_.at(id);
    if (session->grants().allow(caller, Access::see)) result.push_back(session);
  }
  return result;
}

bool SessionStore::was_removed(const std::string& id, const Request& request) const {
  const auto found = std::find_if(removals_.begin(), removals_.end(),
                                  [&](const auto& removal) { return removal.first == request; });
  if (found == removals_.end()) return false;
  if (found->second == id) return true;
  refuse_other_request(request.second);
}

SessionStore::Removal SessionStore::begin_removal(const std::string& id, const Caller& caller,
                                                  const std::string& request_id) {
  check_request_id(request_id);
  const Request request(caller.identity, request_id);
  {
    Guard guard(mutex_);
    if (!request_id.empty() && was_removed(id, request)) return {nullptr, true};
    if (!find(id, caller, Access::own, "")) return {};
  }
  const SessionPtr session = take_out(id);
  if (!session) return {};  // another call was quicker
  note_removal(id, request);
  session->close();
  return {session};
}

// One that is not alive may become so while it is looked for on the disk, and the other way round.
void SessionStore::end_removal(Removal removal, const std::string& id, const Caller& caller,
                               const Call& call, const std::string& request_id) {
  constexpr int kTries = 3;
  for (int tries = 0; !removal.session && !removal.repeated; ++tries) {
    if (keeper_.remove && keeper_.remove(id, caller, call, request_id)) return;
    removal = begin_removal(id, caller, request_id);
    if (tries == kTries && !removal.session) refuse_unknown(id);
  }
  if (removal.repeated) return;
  if (removal.session->keeping() && keeper_.note)
    keeper_.note(id, Request(caller.identity, request_id));
  removal.session->discard_results();
  bury(removal.session, v1::DELETION_CAUSE_ASKED);
}

void SessionStore::note_removal(const std::string& id, const Request& request) {
  if (request.second.empty()) return;
  Guard guard(mutex_);
  removals_.emplace_back(request, id);
  if (removals_.size() > kRemovals) removals_.pop_front();
}

void SessionStore::discard(const std::string& id) {
  SessionPtr session;
  {
    Guard guard(mutex_);
    if (repeated_.count(id) == 0) session = take_out_held(id);
  }
  if (!session) return;
  session->discard_results();
  session->close();
  bury(session, v1::DELETION_CAUSE_ASKED);
}

SessionPtr SessionStore::take_out(const std::string& id) {
  Guard guard(mutex_);
  return take_out_held(id);
}

SessionPtr SessionStore::take_out_held(const std::string& id) {
  const auto found = sessions_.find(id);
  if (found == sessions_.end()) return nullptr;
  SessionPtr session = std::move(found->second);
  sessions_.erase(found);
  std::erase(order_, id);
  repeated_.erase(id);
  return session;
}

void SessionStore::drop(const std::string& id, v1::DeletionCause cause) {
  const SessionPtr session = take_out(id);
  if (!session) return;
  session->close();
  bury(session, cause);
}

/// One that is closed and taken out.
void SessionStore::bury(const SessionPtr& session, v1::DeletionCause cause) {
  session->close_deck_sockets();
  if (session->keeping() && keeper_.forget) keeper_.forget(*session);
  log_.deleted(session->subject(), cause);
}

// From memory to the disk, unless somebody uses it after all.
void SessionStore::park(const SessionPtr& session) {
  const std::string& id = session->identity().id;
  if (!keeper_.suspend(*session)) return session->lease().renew();
  if (!session->lease().expire(std::chrono::steady_clock::now())) return keeper_.unsuspend(id);
  session->keeping()->end();
  // Nobody brings it back before it is taken out: what is told of that comes later.
  log_.state_changed(session->subject(), v1::SIMULATION_STATE_SUSPENDED, session->step_number());
  take_out(id);
  session->close();
}

void SessionStore::note_end_of_server() {
  Guard guard(mutex_);
  for (const auto& [id, session] : sessions_) session->note_end_of_server();
}

void SessionStore::close_all() {
  note_end_of_server();  // also those that came back meanwhile
  Guard guard(mutex_);
  for (const auto& [id, session] : sessions_) session->close();
}

void SessionStore::close_expired() {
  std::vector<std::string> expired;
  std::vector<SessionPtr> parked;
  {
    Guard guard(mutex_);
    const auto now = std::chrono::steady_clock::now();
    for (const auto& [id, session] : sessions_) {
      if (session->keeping() && session->lease().is_over(now)) parked.push_back(session);
      if (!session->keeping() && session->lease().expire(now)) expired.push_back(id);
      if (const auto left = session->lease().warn(now))
        log_.lease_ending(session->subject(), std::chrono::duration<double>(*left).count());
    }
  }
  for (const SessionPtr& session : parked) park(session);
  for (const std::string& id : expired) drop(id, v1::DELETION_CAUSE_LEASE_OVER);
}

void SessionStore::watch_leases() {
  constexpr std::chrono::milliseconds kPeriod(200);
  Guard guard(mutex_);
  while (!stop_) {
    changed_.wait_for(mutex_, kPeriod);
    guard.unlock();
    run_caught("leases", [this] { close_expired(); });
    guard.lock();
  }
}

}  // namespace mbcosim::server
