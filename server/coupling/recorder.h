/// Keeps all that crosses the ports of a session, so that it can be replayed.
#pragma once

#include <cstdint>
#include <string>

#include "mbcosim/v1/record.pb.h"
#include "threads/mutex.h"
#include "wire/memory.h"

namespace mbcosim::server {

v1::StepNotice step_notice(std::int64_t step, double time);

/// Thread-safe. Entries are kept as a file of delimited messages; at the limit the record ends with
/// `cut_off`.
class Recorder {
 public:
  Recorder(std::int64_t most_bytes, MemoryBudget& memory)
      : most_bytes_(most_bytes), memory_(memory) {}
  void add(const v1::RecordEntry& entry);
  void attached(const std::string& port, const v1::Welcome& welcome);
  void detached(const std::string& port);
  void sent(const std::string& port, const v1::ServerMessage& message);
  void received(const std::string& port, const v1::PeerExchange& answer);
  void lost(const std::string& port, const std::string& why);
  void stepped(bool accepted, std::int64_t step, double time);
  void restored(std::int64_t step, double time);
  void inputs(const v1::Values& values);
  /// What was chosen of the step that follows.
  void chosen(const v1::StepRequest& step);

  /// At most `size` bytes of the record from `at` on; empty: there are no more.
  std::string read(std::size_t at, std::size_t size) const;

 private:
  bool has_room(std::int64_t bytes) TS_REQUIRES(mutex_);

  const std::int64_t most_bytes_;
  mutable Mutex mutex_;
  MemoryShare memory_ TS_GUARDED_BY(mutex_);  ///< at least that of `bytes_`
  std::string bytes_ TS_GUARDED_BY(mutex_);
  bool full_ TS_GUARDED_BY(mutex_) = false;
};

}  // namespace mbcosim::server
