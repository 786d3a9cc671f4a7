/// How much memory the daemon's work may take, counted before it is taken.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <utility>

#include "solver/cancel.h"

namespace mbcosim::server {

/// Bytes that may still be taken, of which some may be those of a larger budget. Thread-safe.
class MemoryBudget {
 public:
  /// `of`: what is taken here is taken there, too; null: nowhere.
  explicit MemoryBudget(std::int64_t most, MemoryBudget* of = nullptr) : most_(most), of_(of) {}
  std::int64_t most() const { return most_; }
  std::int64_t used() const { return used_.load(std::memory_order_relaxed); }
  /// Null: taken. Else nothing is, and the budget that has not so much left.
  const MemoryBudget* take(std::int64_t bytes) {
    if (used_.fetch_add(bytes, std::memory_order_relaxed) + bytes > most_) {
      used_.fetch_sub(bytes, std::memory_order_relaxed);
      return this;
    }
    const MemoryBudget* full = of_ ? of_->take(bytes) : nullptr;
    if (full) used_.fetch_sub(bytes, std::memory_order_relaxed);
    return full;
  }
  void give_back(std::int64_t bytes) {
    used_.fetch_sub(bytes, std::memory_order_relaxed);
    if (of_) of_->give_back(bytes);
  }

  /// Throws LIMIT_EXCEEDED, limit "memory_bytes", or "identity_memory_bytes" for a part.
  [[noreturn]] void refuse() const;
  /// A share of what the machine has, or of what systemd or a container leaves to this process.
  static std::int64_t default_bytes();

 private:
  const std::int64_t most_;
  MemoryBudget* const of_;
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
    if (const MemoryBudget* full = budget_->take(bytes)) full->refuse();
    bytes_ += bytes;
  }
  void shrink(std::int64_t bytes) {
    if (!budget_) return;
    budget_->give_back(bytes);
    bytes_ -= bytes;
  }
  /// By what is there already or has gone: never refused.
  void change(std::int64_t bytes) { shrink(std::min(-bytes, bytes_)); }

 private:
  friend class MemoryScope;
  void swap(MemoryShare& other) noexcept {
    std::swap(budget_, other.budget_);
    std::swap(bytes_, other.bytes_);
  }
  MemoryBudget* budget_ = nullptr;
  std::int64_t bytes_ = 0;
};

/// While it lives, what this thread allocates is counted: reading a deck or a message takes many
/// times its bytes, as factoring a matrix does, and how many is not known before. At the end of the
/// budget, and when the work is cancelled, `new` throws std::bad_alloc, again and again until the
/// work gives up, and `malloc` has no large block to give (the C libraries of the solver handle
/// that); `check` then tells why. Not to be held while gRPC is called, which does not expect that.
class MemoryScope {
 public:
  explicit MemoryScope(MemoryBudget& budget, const CancelToken* cancel = nullptr);
  ~MemoryScope();
  MemoryScope(const MemoryScope&) = delete;
  MemoryScope& operator=(const MemoryScope&) = delete;

  /// Did the work come to its end so?
  bool refused() const { return exceeded_ || cancelled_; }
  /// Throws LIMIT_EXCEEDED or CANCELLED when it did.
  void check() const;
  /// What was allocated and is still there, handed over. Nothing is counted from then on.
  MemoryShare keep();
  /// Stops counting; what was counted stays taken until the end.
  void leave();

  // --- from the allocator
  static MemoryScope* current();
  /// False: refused. `must`: counted all the same, the next one is refused.
  bool add(std::int64_t bytes, bool must) noexcept;
  void subtract(std::int64_t bytes) noexcept { net_ -= bytes; }

 private:
  MemoryBudget& budget_;
  const CancelToken* const cancel_;
  MemoryScope* const outer_;
  std::int64_t net_ = 0, taken_ = 0;
  int calls_ = 0;
  const MemoryBudget* exceeded_ = nullptr;  ///< the one that was
  bool cancelled_ = false, left_ = false;
};

/// While it lives, nothing that this thread allocates is counted: for calls out of counted work.
class MemoryPause {
 public:
  MemoryPause();
  ~MemoryPause();
  MemoryPause(const MemoryPause&) = delete;
  MemoryPause& operator=(const MemoryPause&) = delete;

 private:
  MemoryScope* const scope_;
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

/// Memory of the process that is in the machine's.
std::int64_t resident_bytes();

}  // namespace mbcosim::server
