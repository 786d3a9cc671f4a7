#include "wire/memory.h"

#include <malloc.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <fstream>
#include <new>

#include "host/control_group.h"
#include "wire/refusal.h"

namespace mbcosim::server {
namespace {

constexpr std::int64_t kSlab = 1 << 20;  ///< taken from the budget at a time
constexpr int kLook = 1024;              ///< allocations between two looks at the token

thread_local MemoryScope* scope_of_thread = nullptr;

}  // namespace

void MemoryBudget::refuse() const {
  if (of_)
    throw limit_refusal("identity_memory_bytes", most_,
                        "the memory that one identity may have is used up");
  throw limit_refusal("memory_bytes", most_, "the server's memory budget is used up");
}

std::int64_t MemoryBudget::default_bytes() {
  constexpr double kShare = 0.6;  // the rest is for gRPC, factorizations and the system
  const std::int64_t machine = static_cast<std::int64_t>(::sysconf(_SC_PHYS_PAGES)) *
                               static_cast<std::int64_t>(::sysconf(_SC_PAGE_SIZE));
  const std::int64_t bytes = std::min(machine, control_group_memory());
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

bool MemoryScope::add(std::int64_t bytes, bool must) noexcept {
  const bool large = bytes >= kSlab;
  if ((large || ++calls_ % kLook == 0) && cancel_ && cancel_->cancelled()) cancelled_ = true;
  if ((exceeded_ || cancelled_) && !must) return false;
  const std::int64_t wanted = net_ + bytes;
  if (wanted > taken_) {
    const std::int64_t more = (wanted - taken_ + kSlab - 1) / kSlab * kSlab;
    if (const MemoryBudget* full = budget_.take(more)) {
      exceeded_ = full;
      if (!must) return false;
    } else {
      taken_ += more;
    }
  }
  net_ = wanted;
  return true;
}

void MemoryScope::check() const {
  if (exceeded_) exceeded_->refuse();
  if (cancelled_) throw Refusal(v1::REASON_CANCELLED, "the call was cancelled");
}

MemoryShare MemoryScope::keep() {
  leave();
  MemoryShare share(budget_);
  share.bytes_ = std::clamp<std::int64_t>(net_, 0, taken_);
  taken_ -= share.bytes_;
  return share;
}

MemoryPause::MemoryPause() : scope_(std::exchange(scope_of_thread, nullptr)) {}
MemoryPause::~MemoryPause() { scope_of_thread = scope_; }

std::int64_t resident_bytes() {
  std::int64_t all = 0, resident = 0;
  std::ifstream("/proc/self/statm") >> all >> resident;
  return resident * ::sysconf(_SC_PAGESIZE);
}

}  // namespace mbcosim::server

// ------------------------------------------------------------------ what is counted

#ifndef MBCOSIM_SANITIZED

// The C library's own, behind `malloc` and its like.
extern "C" {
void* __libc_malloc(std::size_t bytes);
void* __libc_calloc(std::size_t count, std::size_t bytes);
void* __libc_realloc(void* memory, std::size_t bytes);
void* __libc_memalign(std::size_t alignment, std::size_t bytes);
void __libc_free(void* memory);
}

namespace {

using mbcosim::server::MemoryScope;

constexpr std::size_t kLarge = 64 << 10;  ///< what a C library expects to be refused

std::int64_t signed_of(std::size_t bytes) {
  return static_cast<std::int64_t>(std::min(bytes, std::size_t{1} << 62));
}

/// `allocate` gives the memory; null when it is refused. Counted before it is there.
template <class Allocate>
void* counted(std::size_t bytes, bool must, Allocate&& allocate) {
  MemoryScope* scope = MemoryScope::current();
  if (!scope) return allocate();
  if (!scope->add(signed_of(bytes), must)) return nullptr;
  void* memory = allocate();
  // The allocator rounds up; `release` counts what it has.
  const std::int64_t has = memory ? static_cast<std::int64_t>(malloc_usable_size(memory)) : 0;
  scope->subtract(signed_of(bytes) - has);
  return memory;
}

void* for_c(void* memory) {
  if (!memory) errno = ENOMEM;
  return memory;
}

void* for_new(std::size_t bytes, std::size_t alignment = 0) {
  void* memory = counted(bytes, false, [&] {
    return alignment > 0 ? __libc_memalign(alignment, bytes) : __libc_malloc(bytes > 0 ? bytes : 1);
  });
  if (!memory) throw std::bad_alloc();
  return memory;
}

void release(void* memory) noexcept {
  if (!memory) return;
  if (MemoryScope* scope = MemoryScope::current())
    scope->subtract(static_cast<std::int64_t>(malloc_usable_size(memory)));
  __libc_free(memory);
}

}  // namespace

extern "C" {

void* malloc(std::size_t bytes) {
  return for_c(counted(bytes, bytes < kLarge, [&] { return __libc_malloc(bytes); }));
}

void* calloc(std::size_t count, std::size_t bytes) {
  std::size_t all = 0;
  if (__builtin_mul_overflow(count, bytes, &all)) return for_c(nullptr);
  return for_c(counted(all, all < kLarge, [&] { return __libc_calloc(count, bytes); }));
}

void* realloc(void* memory, std::size_t bytes) {
  MemoryScope* scope = MemoryScope::current();
  if (!scope || !memory) return memory ? __libc_realloc(memory, bytes) : malloc(bytes);
  const auto before = static_cast<std::int64_t>(malloc_usable_size(memory));
  void* moved = counted(bytes, bytes < kLarge, [&] { return __libc_realloc(memory, bytes); });
  if (!moved && bytes > 0) return for_c(nullptr);
  scope->subtract(before);
  return moved;
}

void* aligned_alloc(std::size_t alignment, std::size_t bytes) {
  return for_c(counted(bytes, bytes < kLarge, [&] { return __libc_memalign(alignment, bytes); }));
}

void* memalign(std::size_t alignment, std::size_t bytes) { return aligned_alloc(alignment, bytes); }

int posix_memalign(void** memory, std::size_t alignment, std::size_t bytes) {
  if (alignment % sizeof(void*) != 0 || (alignment & (alignment - 1)) != 0) return EINVAL;
  *memory = counted(bytes, bytes < kLarge, [&] { return __libc_memalign(alignment, bytes); });
  return *memory ? 0 : ENOMEM;
}

void free(void* memory) { release(memory); }

}  // extern "C"

void* operator new(std::size_t bytes) { return for_new(bytes); }
void* operator new(std::size_t bytes, std::align_val_t alignment) {
  return for_new(bytes, static_cast<std::size_t>(alignment));
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
