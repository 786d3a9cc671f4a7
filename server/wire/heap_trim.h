/// What the heap keeps of memory that has been freed.
#pragma once

#include <chrono>
#include <cstdint>
#include <limits>

#include "wire/memory.h"

namespace mbcosim::server {

/// Gives it back to the system some time after much has been freed, and now and then while much is
/// resident that no budget counts: allocation waits meanwhile, some 0.1 s for each GB. For one
/// thread.
class HeapTrim {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr std::int64_t kMuch = 64 << 20;  ///< bytes
  static constexpr std::chrono::milliseconds kRest{1500};
  static constexpr std::chrono::seconds kUncountedLook{20};

  explicit HeapTrim(const MemoryBudget& budget) : budget_(budget) {}
  /// Memory that no budget counts has been freed, or will be soon.
  void ask(Clock::time_point now);
  /// To be called now and then. True: it has been given back.
  bool look(Clock::time_point now);

 private:
  void plan(Clock::time_point now, int times);
  bool much_is_uncounted();

  const MemoryBudget& budget_;
  std::int64_t most_ = 0;  ///< of the budget was used since the last time
  int times_ = 0;          ///< it is to be given back, one after the other
  Clock::time_point next_{}, next_uncounted_{};
  std::int64_t least_uncounted_ = std::numeric_limits<std::int64_t>::max();  ///< bytes
};

}  // namespace mbcosim::server
