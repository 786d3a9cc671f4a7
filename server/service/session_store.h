/// All simulations of a daemon.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <set>
#include <string>
#include <thread>
#include <unordered_map>
#include <utility>
#include <vector>

#include "rpc/auth.h"
#include "rpc/call.h"
#include "service/session.h"
#include "threads/mutex.h"

namespace mbcosim::server {

using SessionPtr = std::shared_ptr<Session>;

/// Thread-safe. Closes sessions whose lease is over.
class SessionStore {
 public:
  using Request = std::pair<std::string, std::string>;  ///< identity and request id
  /// So many deletions are known for who asks again.
  static constexpr std::size_t kRemovals = 1024;

  SessionStore(const ServiceLimits& limits, EventLog& log);
  ~SessionStore();

  /// A place for one more session, taken before the work of creating it starts. A creation with a
  /// request id is done once: who repeats it waits for the first and gets its session.
  class Place {
   public:
    /// `digest`: of the request. Throws LIMIT_EXCEEDED when all places are taken, BAD_ARGUMENT when
    /// the id was another request's, CANCELLED when the call ends first.
    Place(SessionStore& store, const std::string& request_id, std::uint64_t digest,
          const Caller& caller, const Call& call);
    ~Place();
    Place(const Place&) = delete;
    Place& operator=(const Place&) = delete;
    /// The session that the caller created earlier with this request id, or null.
    const SessionPtr& known() const { return known_; }

   private:
    SessionStore& store_;
    const Request request_;
    SessionPtr known_;
  };

  /// Who keeps sessions on the disk. Called without any lock.
  struct Keeper {
    std::function<bool(const std::string& id, const Caller&, Call&)> wake;  ///< true: it is back
    /// True: it was there. Waits for one that is being brought back.
    std::function<bool(const std::string& id, const Caller&, const Call&,
                       const std::string& request_id)>
        remove;
    /// A session is about to be forgotten, as this request wants: its repeat is known from now on.
    std::function<void(const std::string& id, const Request&)> note;
    std::function<bool(Session&)> suspend;                 ///< false: it must live on
    std::function<void(const std::string& id)> unsuspend;  ///< it lives on after all
    std::function<void(Session&)> forget;
    /// The call has the keeping's mutex. Throws STORAGE_FULL.
    std::function<void(Session&, CapturedPoint)> store;
  };
  /// Before anybody uses the store.
  void set_keeper(Keeper keeper) { keeper_ = std::move(keeper); }

  void add(SessionPtr session);
  /// What a durable session becomes by a call that changes it. Throws STORAGE_FULL.
  void put_on_disk(Session& session, CapturedPoint captured) const {
    keeper_.store(session, std::move(captured));
  }
  std::vector<SessionPtr> all() const;
  bool has(const std::string& id) const;
  /// Throws NO_SUCH_SIMULATION, also for one that the caller may not see, and NOT_GRANTED.
  /// One that is on the disk is brought back; CANCELLED when the call ends first.
  SessionPtr get(const std::string& id, const Caller& caller, Call& call, Access access,
                 const std::string& port = "") const;
  /// The same of one that is in memory; null: it is not, or the caller may not see it.
  SessionPtr get_alive(const std::string& id, const Caller& caller, Access access) const;
  /// What the caller may see, in the order of creation.
  std::vector<SessionPtr> list(const Caller& caller) const;
  /// Deletes in two parts. The first ends one that is alive, and with it all that waits for it; it
  /// never waits. A repeat with the request's id does nothing more. Throws NO_SUCH_SIMULATION,
  /// NOT_GRANTED, BAD_ARGUMENT.
  struct Removal {
    SessionPtr session;  ///< ended and taken out; null: it is not alive
    bool repeated = false;
  };
  Removal begin_removal(const std::string& id, const Caller& caller, const std::string& request_id);
  /// The second removes what is on the disk. Waits for a checkpoint that is under way, and for one
  /// that is being brought back. Throws the same, and CANCELLED when the call ends first.
  void end_removal(Removal removal, const std::string& id, const Caller& caller, const Call& call,
                   const std::string& request_id);
  /// The repeat of this deletion does nothing more; without a request id nothing is noted.
  void note_removal(const std::string& id, const Request& request) TS_EXCLUDES(mutex_);
  /// The same for a session whose creator did not learn its name. One that a repeat of the creation
  /// was given stays.
  void discard(const std::string& id);
  /// Ends a session; nothing when it is gone already.
  void drop(const std::string& id, v1::DeletionCause cause = v1::DELETION_CAUSE_ASKED);
  /// What ends calls from now on is the end of the server.
  void note_end_of_server() TS_EXCLUDES(mutex_);
  void close_all() TS_EXCLUDES(mutex_);

 private:
  SessionPtr find_request(const Request& request) const TS_REQUIRES(mutex_);
  bool was_removed(const std::string& id, const Request& request) const TS_REQUIRES(mutex_);
  void check_room(const std::string& owner) const TS_REQUIRES(mutex_);
  SessionPtr find(const std::string& id, const Caller& caller, Access access,
                  const std::string& port) const TS_REQUIRES(mutex_);
  SessionPtr take_out(const std::string& id) TS_EXCLUDES(mutex_);
  SessionPtr take_out_held(const std::string& id) TS_REQUIRES(mutex_);
  void bury(const SessionPtr& session, v1::DeletionCause cause);
  void park(const SessionPtr& session);
  void watch_leases();
  void close_expired();

  const ServiceLimits& limits_;
  EventLog& log_;
  Keeper keeper_;
  mutable Mutex mutex_;
  std::unordered_map<std::string, SessionPtr> sessions_ TS_GUARDED_BY(mutex_);
  std::vector<std::string> order_ TS_GUARDED_BY(mutex_);
  std::multiset<std::string> places_ TS_GUARDED_BY(mutex_);  ///< owners of creations under way
  std::set<Request> creations_ TS_GUARDED_BY(mutex_);        ///< under way, with a request id
  std::set<std::string> repeated_ TS_GUARDED_BY(mutex_);     ///< that a repeat of the creation has
  /// The last deletions that had a request id, and what they deleted.
  std::deque<std::pair<Request, std::string>> removals_ TS_GUARDED_BY(mutex_);
  bool stop_ TS_GUARDED_BY(mutex_) = false;
  Condition changed_;
  std::thread lease_thread_;
};

/// A session found and kept alive. Throws as SessionStore::get.
class SessionHold {
 public:
  SessionHold(const SessionStore& store, const std::string& id, const Caller& caller, Call& call,
              Access access, const std::string& port = "")
      : SessionHold(find(store, id, caller, call, access, port)) {}
  /// Takes over what the caller has taken of the lease.
  SessionHold(SessionPtr session, std::adopt_lock_t adopt)
      : session_(std::move(session)), use_(*session_, adopt) {}
  Session& operator*() const { return *session_; }
  Session* operator->() const { return session_.get(); }

 private:
  explicit SessionHold(SessionPtr session) : session_(std::move(session)), use_(*session_) {}

  // A session that is going to the disk at the moment can be taken when it is there.
  static SessionPtr find(const SessionStore& store, const std::string& id, const Caller& caller,
                         Call& call, Access access, const std::string& port) {
    SessionPtr session = store.get(id, caller, call, access, port);
    for (int tries = 0; tries < 20 && session->lease().ended() && session->keeping(); ++tries) {
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
      session = store.get(id, caller, call, access, port);
    }
    return session;
  }
  const SessionPtr session_;
  const Session::Use use_;
};

}  // namespace mbcosim::server
