#include "wire/memory.h"

#include <malloc.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <new>
#include <string>

#include "wire/refusal.h"

namespace mbcosim::server {
namespace {

constexpr std::int64_t kSlab = 1 << 20;  ///< taken from the budget at a time
constexpr int kLook = 1024;              ///< allocations between two looks at the token

thread_local MemoryScope* scope_of_thread = nullptr;

/// First number of a file; negative: none ("max", or no such file).
std::int64_t number_in(const char* path) {
  std::ifstream file(path);
  std::int64_t number = -1;
  return file >> number ? number : -1;
}

}  // namespace

void MemoryBudget::refuse() const {
  throw limit_refusal("memory_bytes", most_, "the server's memory budget is used up");
}

std::int64_t MemoryBudget::default_bytes() {
  constexpr double kShare = 0.6;  // the rest is for gRPC, factorizations and the system
  std::int64_t bytes = static_cast<std::int64_t>(::sysconf(_SC_PHYS_PAGES)) *
                       static_cast<std::int64_t>(::sysconf(_SC_PAGE_SIZE));
  for (const char* path :
       {"/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes"}) {
    const std::int64_t limit = number_in(path);
    if (limit > 0) bytes = std::min(bytes, limit);
  }
  return static_cast<std::int64_t>(kShare * static_cast<double>(bytes));
}

MemoryScope::MemoryScope(MemoryBudget& budget, const CancelToken* cancel)
    : budget_(budget), cancel_(cancel), outer_(std::exchange(scope_of_thread, this)) {}

MemoryScope::~MemoryScope() {
  leave();
  budget_.give_back(taken_);
}

void MemoryScope::leave() {
  if (!std::exchange(left_, true)) scope_of_thread = outer_;
}

MemoryScope* MemoryScope::current() { return scope_of_thread; }

void MemoryScope::add(std::int64_t bytes) {
  if (++calls_ % kLook == 0 && cancel_ && cancel_->cancelled()) cancelled_ = true;
  if (exceeded_ || cancelled_) throw std::bad_alloc();
  const std::int64_t wanted = net_ + bytes;
  if (wanted > taken_) {
    const std::int64_t more = (wanted - taken_ + kSlab - 1) / kSlab * kSlab;
    if (!budget_.take(more)) {
      exceeded_ = true;
      throw std::bad_alloc();
    }
    taken_ += more;
  }
  net_ = wanted;
}

void MemoryScope::check() const {
  if (exceeded_) budget_.refuse();
  if (cancelled_) throw Refusal(v1::REASON_CANCELLED, "the call was cancelled");
}

MemoryShare MemoryScope::keep() {
  leave();
  MemoryShare share(budget_);
  share.bytes_ = std::clamp<std::int64_t>(net_, 0, taken_);
  taken_ -= share.bytes_;
  return share;
}

}  // namespace mbcosim::server

// ------------------------------------------------------------------ what is counted

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)

namespace {

using mbcosim::server::MemoryScope;

// Before the memory is there: a scope may refuse.
void count(std::size_t bytes) {
  if (MemoryScope* scope = MemoryScope::current()) scope->add(static_cast<std::int64_t>(bytes));
}

void* counted(void* memory, std::size_t bytes) {
  MemoryScope* scope = MemoryScope::current();
  if (!memory) {
    if (scope) scope->subtract(static_cast<std::int64_t>(bytes));
    throw std::bad_alloc();
  }
  if (scope)  // the allocator rounds up; `release` counts what it has
    scope->subtract(static_cast<std::int64_t>(bytes) -
                    static_cast<std::int64_t>(malloc_usable_size(memory)));
  return memory;
}

void release(void* memory) noexcept {
  if (!memory) return;
  if (MemoryScope* scope = MemoryScope::current())
    scope->subtract(static_cast<std::int64_t>(malloc_usable_size(memory)));
  std::free(memory);
}

}  // namespace

void* operator new(std::size_t bytes) {
  count(bytes);
  return counted(std::malloc(bytes > 0 ? bytes : 1), bytes);
}

void* operator new(std::size_t bytes, std::align_val_t alignment) {
  count(bytes);
  const auto step = static_cast<std::size_t>(alignment);
  return counted(std::aligned_alloc(step, (bytes + step - 1) / step * step), bytes);
}

void* operator new[](std::size_t bytes) { return operator new(bytes); }
void* operator new[](std::size_t bytes, std::align_val_t a) { return operator new(bytes, a); }
void operator delete(void* memory) noexcept { release(memory); }
void operator delete(void* memory, std::size_t) noexcept { release(memory); }
void operator delete(void* memory, std::align_val_t) noexcept { release(memory); }
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept { release(memory); }
void operator delete[](void* memory) noexcept { release(memory); }
void operator delete[](void* memory, std::size_t) noexcept { release(memory); }
void operator delete[](void* memory, std::align_val_t) noexcept { release(memory); }
void operator delete[](void* memory, std::size_t, std::align_val_t) noexcept { release(memory); }

#endif
