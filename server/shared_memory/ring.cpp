#include "shared_memory/ring.h"

#include <linux/futex.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#include <climits>
#include <cstring>

namespace mbcosim::shm {

static_assert(std::atomic<std::uint64_t>::is_always_lock_free);
static_assert(sizeof(std::atomic<std::uint32_t>) == sizeof(std::uint32_t), "a futex is 32 bits");

// ------------------------------------------------------------------ Bell

void Bell::ring() {
  if (sleepers.load() != 0) ring_always();
}

void Bell::ring_always() {
  rings.fetch_add(1);
  ::syscall(SYS_futex, reinterpret_cast<std::uint32_t*>(&rings), FUTEX_WAKE, INT_MAX, nullptr,
            nullptr, 0);
}

void Bell::wait(std::uint32_t seen, Clock::time_point until) {
  const auto left = std::chrono::nanoseconds(until - Clock::now()).count();
  if (left <= 0) return;
  constexpr long kBillion = 1000000000;
  const timespec time{static_cast<time_t>(left / kBillion), static_cast<long>(left % kBillion)};
  ::syscall(SYS_futex, reinterpret_cast<std::uint32_t*>(&rings), FUTEX_WAIT, seen, &time, nullptr,
            0);
}

// ------------------------------------------------------------------ writing

std::size_t RingWriter::space() const {
  const std::uint64_t used = written_ - header_->read.load();
  if (used > capacity_) throw Corrupt("the reader's counter is wrong");
  return capacity_ - static_cast<std::size_t>(used);
}

void RingWriter::put(const void* bytes, std::size_t count) {
  const std::size_t at = written_ % capacity_;
  const std::size_t first = std::min(count, capacity_ - at);
  std::memcpy(bytes_ + at, bytes, first);
  std::memcpy(bytes_, static_cast<const std::byte*>(bytes) + first, count - first);
  written_ += count;
}

void RingWriter::publish() {
  header_->written.store(written_);
  header_->data.ring();
}

// ------------------------------------------------------------------ reading

std::size_t RingReader::available() const {
  const std::uint64_t count = header_->written.load() - read_;
  if (count > capacity_) throw Corrupt("the writer's counter is wrong");
  return static_cast<std::size_t>(count);
}

void RingReader::take(void* bytes, std::size_t count) {
  const std::size_t at = read_ % capacity_;
  const std::size_t first = std::min(count, capacity_ - at);
  std::memcpy(bytes, bytes_ + at, first);
  std::memcpy(static_cast<std::byte*>(bytes) + first, bytes_, count - first);
  read_ += count;
}

void RingReader::release() {
  header_->read.store(read_);
  header_->space.ring();
}

}  // namespace mbcosim::shm
