/// Samples on their way from a stepping session to its subscribers.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "mbcosim/v1/telemetry.pb.h"
#include "rpc/lanes.h"
#include "service/metrics.h"
#include "service/telemetry_track.h"
#include "simulation/simulation.h"
#include "threads/mutex.h"
#include "threads/timer.h"
#include "wire/memory.h"

namespace mbcosim::server {

struct Feed;

/// What one subscriber asked for, and how far it has come.
struct Subscription {
  struct Options {
    std::vector<int> handles;
    Rhythm rhythm;
    v1::OverflowPolicy policy = v1::OVERFLOW_POLICY_DROP_OLDEST;
    std::int64_t capacity = 1024;  ///< samples kept for it
    std::int64_t batch_bytes = 0;  ///< that a batch on its way takes, besides its last sample
    std::chrono::milliseconds block_timeout{10000};
    std::string identity;        ///< whose it is
    std::function<void()> wake;  ///< there may be something to take
  };
  explicit Subscription(Options o) : options(std::move(o)) {}

 private:
  friend class TelemetryHub;
  const Options options;
  // All below belong to the hub, under its lock.
  Feed* feed = nullptr;
  std::int64_t first = 0, next = 0;  ///< numbers in the track: of the first sample, of the next
  bool hungry = true;                ///< took all there was: it is woken when there is more
  std::int64_t stride = 1;           ///< grows with DECIMATE
  struct Kept {
    std::string sample;
    std::int64_t sequence;
  };
  std::deque<Kept> kept;  ///< with DECIMATE: thinned out, so they are not the track's
  MemoryShare share;      ///< of those
  std::int64_t sequence = 0, dropped = 0, total_dropped = 0;
  std::chrono::steady_clock::time_point blocks_since{};  ///< it keeps the session waiting; else 0
  bool stalled = false;
};
using SubscriptionPtr = std::shared_ptr<Subscription>;

/// The subscribers of one session. A variable is evaluated once for a step however many want it,
/// and samples are serialized when they are taken, once for equal subscriptions: one that nobody
/// takes costs its values' place in a ring. Who reads is woken by threads of a pool, together and
/// at most every few milliseconds; who does not is not. Thread-safe.
class TelemetryHub : public std::enable_shared_from_this<TelemetryHub> {
 public:
  /// `metrics`: counts samples that are dropped; may be null.
  TelemetryHub(MemoryBudget& memory, Lanes& lanes, Timer& timer, Metrics* metrics = nullptr);
  ~TelemetryHub();

  /// `sizes`: numbers that each of the handles stands for. Throws LIMIT_EXCEEDED when the samples
  /// that may be kept would take too much memory.
  void add(const SubscriptionPtr& subscription, std::span<const int> sizes) TS_EXCLUDES(mutex_);
  void remove(const SubscriptionPtr& subscription) TS_EXCLUDES(mutex_);
  /// Ends all subscriptions, now and from now on: what is kept can still be taken for a while.
  void close() TS_EXCLUDES(mutex_);

  /// What was done so far: a count of work, for tests.
  struct Work {
    std::int64_t evaluations = 0;  ///< of variables
    std::int64_t serializations = 0, wakes = 0;
  };
  Work work() const TS_EXCLUDES(mutex_);

  // --- the session's thread
  bool empty() const { return !some_.load(std::memory_order_relaxed); }
  /// Keeps the values at the simulation's state for all who want them.
  void publish(const Simulation& simulation) TS_EXCLUDES(mutex_);
  /// Does a subscriber with policy BLOCK have no room for another sample?
  bool blocked() const { return blocked_.load(std::memory_order_relaxed); }
  /// Waits for room, at most `slice`. Who blocks longer than it may is stalled.
  void wait_for_room(std::chrono::milliseconds slice) TS_EXCLUDES(mutex_);
  /// For whom and since when the session waits: "subscriber ann since 0.4 s"; empty: for nobody.
  std::string waiting_for() const TS_EXCLUDES(mutex_);

  // --- a subscriber
  enum class Taken { samples, nothing, closed, stalled };
  /// Moves samples of up to about `most_bytes` into `batch`, a serialized SubscribeReply.
  Taken take(Subscription& subscription, std::size_t most_bytes, std::string* batch)
      TS_EXCLUDES(mutex_);
  /// Does it stand still for too long? It is to end, whatever is on its way to it.
  bool is_stalled(const Subscription& subscription) const TS_EXCLUDES(mutex_);

 private:
  Feed& feed_for(const Subscription::Options& options, std::span<const int> sizes,
                 std::int64_t sample_bytes) TS_REQUIRES(mutex_);
  void release(Feed& feed) TS_REQUIRES(mutex_);
  const std::string& sample(Feed& feed, std::int64_t number) TS_REQUIRES(mutex_);
  const std::string& serialize(const Feed& feed, std::int64_t number, std::string& bytes)
      TS_REQUIRES(mutex_);
  void end_late_readers() TS_EXCLUDES(mutex_);
  void stall(Subscription& s) TS_REQUIRES(mutex_);
  void count_dropped(Subscription& s, std::int64_t count) TS_REQUIRES(mutex_);
  void drop_what_is_late(Subscription& s) TS_REQUIRES(mutex_);
  void keep_for(Subscription& s) TS_REQUIRES(mutex_);
  void decimate(Subscription& s) TS_REQUIRES(mutex_);
  void look_for_blocks() TS_REQUIRES(mutex_);
  void schedule() TS_REQUIRES(mutex_);
  void wake_hungry() TS_EXCLUDES(mutex_);
  void rest() TS_EXCLUDES(mutex_);

  MemoryBudget& memory_;
  Lanes& lanes_;
  Timer& timer_;
  Metrics* const metrics_;
  mutable Mutex mutex_;
  Condition room_;
  struct Rhythmic {
    explicit Rhythmic(MemoryBudget& memory) : track(memory) {}
    Track track;
    std::chrono::steady_clock::time_point due{};  ///< the next sample comes not before
  };
  static bool is_due(const Rhythm& rhythm, std::int64_t step, Rhythmic& of);
  std::map<Rhythm, Rhythmic> tracks_ TS_GUARDED_BY(mutex_);
  std::list<Feed> feeds_ TS_GUARDED_BY(mutex_);
  std::vector<SubscriptionPtr> subscriptions_ TS_GUARDED_BY(mutex_);
  // Those with policy BLOCK, and with DECIMATE.
  std::vector<SubscriptionPtr> blockers_ TS_GUARDED_BY(mutex_), decimators_ TS_GUARDED_BY(mutex_);
  std::vector<double> values_ TS_GUARDED_BY(mutex_);
  v1::Sample scratch_ TS_GUARDED_BY(mutex_);
  std::string late_ TS_GUARDED_BY(mutex_);  ///< a sample for one who is behind the others
  Work work_ TS_GUARDED_BY(mutex_);
  bool closed_ TS_GUARDED_BY(mutex_) = false;
  bool scheduled_ TS_GUARDED_BY(mutex_) = false;  ///< a round of waking comes
  bool news_ TS_GUARDED_BY(mutex_) = false;       ///< since the last round
  int hungry_ TS_GUARDED_BY(mutex_) = 0;          ///< subscriptions that are
  std::atomic<bool> some_{false}, blocked_{false};
};

}  // namespace mbcosim::server
