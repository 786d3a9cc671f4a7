/// A ring of bytes in memory shared by two processes: one writes, one reads.
#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <stdexcept>

namespace mbcosim::shm {

using Clock = std::chrono::steady_clock;

/// The other side wrote counters that cannot be.
class Corrupt : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Wakes the other side. All accesses are sequentially consistent, so that a sleeper sees the data
/// or its writer sees the sleeper. `rings` is what the kernel waits on (futex).
struct alignas(64) Bell {
  std::atomic<std::uint32_t> rings{0};
  std::atomic<std::uint32_t> sleepers{0};

  /// Wakes who sleeps in `wait`. Costs a look when nobody does.
  void ring();
  void ring_always();
  /// Sleeps until it rings, `seen` is not the count any more, or the time is over.
  void wait(std::uint32_t seen, Clock::time_point until);
};

/// Shared. Counters run on for ever; a side's own counter is never read back from here, so that a
/// wrong other side can do no more than end the connection.
struct RingHeader {
  alignas(64) std::atomic<std::uint64_t> written{0};
  alignas(64) std::atomic<std::uint64_t> read{0};
  Bell data, space;
};

class RingWriter {
 public:
  RingWriter(RingHeader* header, std::byte* bytes, std::size_t capacity)
      : header_(header), bytes_(bytes), capacity_(capacity) {}
  /// Bytes that fit now. Throws Corrupt.
  std::size_t space() const;
  void put(const void* bytes, std::size_t count);  ///< at most space()
  void publish();                                  ///< shows what was put
  Bell& bell() { return header_->space; }
  void wake_other() { header_->data.ring_always(); }

 private:
  RingHeader* header_;
  std::byte* bytes_;
  std::size_t capacity_;
  std::uint64_t written_ = 0;
};

class RingReader {
 public:
  RingReader(RingHeader* header, const std::byte* bytes, std::size_t capacity)
      : header_(header), bytes_(bytes), capacity_(capacity) {}
  /// Bytes that can be taken now. Throws Corrupt.
  std::size_t available() const;
  void take(void* bytes, std::size_t count);  ///< at most available()
  void release();                             ///< gives the room of what was taken back
  Bell& bell() { return header_->data; }
  void wake_other() { header_->space.ring_always(); }

 private:
  RingHeader* header_;
  const std::byte* bytes_;
  std::size_t capacity_;
  std::uint64_t read_ = 0;
};

/// A hint to the core that this is a spin loop.
inline void relax() {
#if defined(__x86_64__) || defined(__i386__)
  __builtin_ia32_pause();
#elif defined(__aarch64__)
  asm volatile("yield");
#endif
}

/// Some looks one after the other. True: `ready()`.
template <class Ready>
bool look(Ready&& ready) {
  constexpr int kLooks = 8;
  for (int k = 0; k < kLooks; ++k) {
    if (ready()) return true;
    relax();
  }
  return false;
}

/// Sleeps until the bell rings. True: `ready()`. May return early.
template <class Ready>
bool wait_until(Bell& bell, Clock::time_point until, Ready&& ready) {
  if (ready()) return true;
  const std::uint32_t seen = bell.rings.load();
  bell.sleepers.store(1);  // before the look at the data; `ring` comes after the data
  if (!ready()) bell.wait(seen, until);
  bell.sleepers.store(0);
  return ready();
}

}  // namespace mbcosim::shm
