/// The latest events of a daemon, for those who watch.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <list>
#include <memory>
#include <string>

#include "mbcosim/v1/events.pb.h"
#include "service/grants.h"
#include "threads/mutex.h"

namespace mbcosim::server {

/// Thread-safe. Keeps so many events and bytes; the oldest make room. Of the
/// checkpoints of a simulation it keeps the latest.
class EventJournal {
 public:
  EventJournal();

  /// Name of this series of sequence numbers.
  const std::string& name() const { return name_; }
  std::int64_t last() const TS_EXCLUDES(mutex_);
  /// Gives it its number and wakes who waits. `rights`: to the simulation, at the moment.
  void add(v1::Event event, RightsPtr rights) TS_EXCLUDES(mutex_);

  /// Somebody who reads the journal.
  struct Reader {
    std::function<bool(const v1::Event&, const Rights&)> wants;
    std::function<void()> wake;  ///< there is something new; called once after `next` said no
    std::int64_t next = 1;       ///< sequence number
    bool waits = false;          ///< belongs to the journal
  };
  using ReaderPtr = std::shared_ptr<Reader>;
  void enter(const ReaderPtr& reader) TS_EXCLUDES(mutex_);
  void leave(const ReaderPtr& reader) TS_EXCLUDES(mutex_);
  /// The next event that the reader wants, or `missed`. False: none for now. `rights`: those to its
  /// simulation when it happened; null with `missed`.
  bool next(Reader& reader, v1::Event* out, RightsPtr* rights) TS_EXCLUDES(mutex_);

 private:
  static constexpr std::size_t kMostEvents = 8192;
  static constexpr std::size_t kMostBytes = 8 << 20;
  struct Kept {
    v1::Event event;
    RightsPtr rights;
    std::size_t bytes;
  };

  const std::string name_;
  mutable Mutex mutex_;
  void drop_checkpoint_before(const v1::Event& event) TS_REQUIRES(mutex_);
  std::deque<Kept> kept_ TS_GUARDED_BY(mutex_);  ///< by their numbers
  std::size_t bytes_ TS_GUARDED_BY(mutex_) = 0;
  std::int64_t gone_ TS_GUARDED_BY(mutex_) = 0;  ///< up to here they have made room
  std::int64_t last_ TS_GUARDED_BY(mutex_) = 0;
  std::list<ReaderPtr> readers_ TS_GUARDED_BY(mutex_);
};

}  // namespace mbcosim::server
