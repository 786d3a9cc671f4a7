/// How much memory the daemon's work may take, counted before it is taken.
#pragma once

#include <atomic>
#include <cstdint>
#include <utility>

#include "solver/cancel.h"

namespace mbcosim::server {

/// Bytes that may still be taken. Thread-safe.
class MemoryBudget {
 public:
  explicit MemoryBudget(std::int64_t most) : most_(most) {}
  std::int64_t most() const { return most_; }
  std::int64_t used() const { return used_.load(std::memory_order_relaxed); }
  bool take(std::int64_t bytes) {
    if (used_.fetch_add(bytes, std::memory_order_relaxed) + bytes <= most_) return true;
    give_back(bytes);
    return false;
  }
  void give_back(std::int64_t bytes) { used_.fetch_sub(bytes, std::memory_order_relaxed); }

  /// Throws LIMIT_EXCEEDED, limit "memory_bytes".
  [[noreturn]] void refuse() const;
  /// A share of what the machine, or its container, has.
  static std::int64_t default_bytes();

 private:
  const std::int64_t most_;
  std::atomic<std::int64_t> used_{0};
};

/// Part of a budget, given back at its end.
class MemoryShare {
 public:
  MemoryShare() = default;
  /// Nothing yet.
  explicit MemoryShare(MemoryBudget& budget) : budget_(&budget) {}
  /// Throws LIMIT_EXCEEDED when there is not so much left.
  MemoryShare(MemoryBudget& budget, std::int64_t bytes) : budget_(&budget) { grow(bytes); }
  MemoryShare(MemoryShare&& other) noexcept { swap(other); }
  MemoryShare& operator=(MemoryShare&& other) noexcept {
    swap(other);
    return *this;
  }
  ~MemoryShare() {
    if (budget_) budget_->give_back(bytes_);
  }
  std::int64_t bytes() const { return bytes_; }
  /// Takes more. Throws LIMIT_EXCEEDED. Without a budget nothing is counted.
  void grow(std::int64_t bytes) {
    if (!budget_) return;
    if (!budget_->take(bytes)) budget_->refuse();
    bytes_ += bytes;
  }
  void shrink(std::int64_t bytes) {
    if (!budget_) return;
    budget_->give_back(bytes);
    bytes_ -= bytes;
  }

 private:
  friend class MemoryScope;
  void swap(MemoryShare& other) noexcept {
    std::swap(budget_, other.budget_);
    std::swap(bytes_, other.bytes_);
  }
  MemoryBudget* budget_ = nullptr;
  std::int64_t bytes_ = 0;
};

/// While it lives, what this thread allocates with `new` is counted: reading a deck or a message
/// takes many times its bytes, and how many is not known before. At the end of the budget, and
/// when the work is cancelled, `new` throws std::bad_alloc, again and again until the work gives
/// up; `check` then tells why. Not to be held while gRPC is called, which does not expect that.
class MemoryScope {
 public:
  explicit MemoryScope(MemoryBudget& budget, const CancelToken* cancel = nullptr);
  ~MemoryScope();
  MemoryScope(const MemoryScope&) = delete;
  MemoryScope& operator=(const MemoryScope&) = delete;

  /// Throws LIMIT_EXCEEDED or CANCELLED when the work came to its end so.
  void check() const;
  /// What was allocated and is still there, handed over. Nothing is counted from then on.
  MemoryShare keep();
  /// Stops counting; what was counted stays taken until the end.
  void leave();

  // --- from `new` and `delete`
  static MemoryScope* current();
  void add(std::int64_t bytes);
  void subtract(std::int64_t bytes) noexcept { net_ -= bytes; }

 private:
  MemoryBudget& budget_;
  const CancelToken* const cancel_;
  MemoryScope* const outer_;
  std::int64_t net_ = 0, taken_ = 0;
  int calls_ = 0;
  bool exceeded_ = false, cancelled_ = false, left_ = false;
};

/// Does work within the budget. What it makes and `kept` is told of stays counted there; else all
/// is given back. Throws LIMIT_EXCEEDED, CANCELLED, and what the work throws.
template <class Work>
auto within(MemoryBudget& budget, const CancelToken* cancel, MemoryShare* kept, Work&& work) {
  MemoryScope scope(budget, cancel);
  try {
    auto result = work();
    scope.leave();
    scope.check();
    if (kept) *kept = scope.keep();
    return result;
  } catch (...) {
    scope.leave();
    scope.check();
    throw;
  }
}

}  // namespace mbcosim::server
