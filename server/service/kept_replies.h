/// Replies of requests that changed something, for clients that did not get them and ask again.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "mbcosim/v1/checkpoints.pb.h"
#include "rpc/auth.h"
#include "rpc/call.h"
#include "threads/mutex.h"
#include "wire/memory.h"

namespace mbcosim::server {

/// Digest of a request and the method that it is for; map fields count in no order.
std::uint64_t digest_of(const char* method, const google::protobuf::MessageLite& request);

/// Thread-safe. Keeps the last replies as long as they are small; the oldest goes first.
class KeptReplies {
 public:
  static constexpr std::size_t kReplies = 64;
  static constexpr std::int64_t kBytes = 8 << 20;  ///< of all replies together

  explicit KeptReplies(MemoryBudget& memory) : share_(memory) {}

  using Messages = google::protobuf::RepeatedPtrField<v1::KeptReply>;
  /// All that are kept, oldest first, and back.
  void describe(Messages* out) const TS_EXCLUDES(mutex_);
  void take_over(const Messages& kept) TS_EXCLUDES(mutex_);
  /// In place of one of the same request; the oldest of too many goes.
  static void put_last(v1::KeptReply reply, Messages* kept);
  /// JOURNAL: those that no entry has, oldest first; then they are in one.
  void describe_unstored(Messages* out) const TS_EXCLUDES(mutex_);
  void all_stored() TS_EXCLUDES(mutex_);

  /// What a request does while the same is at work.
  enum class Repeat { waits, leaves };

  /// One request at work. What went well is kept by `keep`; without it the request may be tried
  /// anew.
  class Turn {
   public:
    /// Waits while the same request is at work. Without an id nothing is kept. Throws BAD_ARGUMENT
    /// when the id is too long or was another request's, SIMULATION_BUSY when another repeat waits
    /// already, CANCELLED when the call ends first.
    /// `of_state`: without the state that it leads to the request was not done.
    Turn(KeptReplies& kept, const Caller& caller, const std::string& request_id,
         std::uint64_t digest, const Call& call, bool of_state = true,
         Repeat repeat = Repeat::waits);
    ~Turn();
    Turn(const Turn&) = delete;
    Turn& operator=(const Turn&) = delete;
    /// The same request is at work and was not waited for: nothing else is known.
    bool must_wait() const { return must_wait_; }
    /// The reply of the first, serialized; null: this is the first.
    const std::string* known() const { return known_ ? &*known_ : nullptr; }
    /// `stored`: it is on the disk already, or need not be.
    void keep(const google::protobuf::MessageLite& reply, bool stored = true);
    /// What the request had done before it was broken off; null: nothing.
    const std::string* begun() const { return begun_ ? &*begun_ : nullptr; }
    /// It is broken off, and a repeat goes on from there.
    void break_off(const google::protobuf::MessageLite& reply);
    /// Is there an id, so that a repeat can be told from another request?
    bool has_id() const { return !id_.empty(); }
    v1::KeptReply described(const google::protobuf::MessageLite& reply, bool begun) const;

   private:
    void put(const google::protobuf::MessageLite& reply, bool begun, bool stored);
    KeptReplies& kept_;
    const std::string identity_, id_;
    const std::uint64_t digest_;
    const bool of_state_;
    bool must_wait_ = false;
    std::optional<std::string> known_, begun_;
  };

 private:
  struct Entry {
    std::string identity, id;
    std::uint64_t digest;
    bool of_state;
    bool at_work = true, awaited = false;
    std::string reply = {};
    bool begun = false;   ///< and broken off
    bool stored = false;  ///< in a journal, or need not be
  };
  using Entries = std::deque<Entry>;

  static void describe(const Entry& entry, v1::KeptReply* out);
  Entry* find(const std::string& identity, const std::string& id) TS_REQUIRES(mutex_);
  void forget(const std::string& identity, const std::string& id) TS_REQUIRES(mutex_);
  std::size_t kept() const TS_REQUIRES(mutex_);
  bool make_room(std::int64_t bytes) TS_REQUIRES(mutex_);
  bool drop_oldest() TS_REQUIRES(mutex_);

  mutable Mutex mutex_;
  Condition changed_;
  Entries entries_ TS_GUARDED_BY(mutex_);  ///< in the order in which they began
  MemoryShare share_ TS_GUARDED_BY(mutex_);
};

/// Throws BAD_ARGUMENT for an id that is too long.
void check_request_id(const std::string& id);

/// Throws BAD_ARGUMENT: a repeat must be the request that it repeats.
[[noreturn]] void refuse_other_request(const std::string& id);

}  // namespace mbcosim::server
