#include "cli/heap.h"

#include <malloc.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include <climits>
#include <cstdint>
#include <cstdlib>

namespace mbcosim::cli {

void keep_heap() {
#if defined(__GLIBC__) && !defined(MBCOSIM_SANITIZED)
  constexpr int kLargest = 32 << 20;  // of what can lie in the heap, as glibc allows
  mallopt(M_MMAP_THRESHOLD, kLargest);
  mallopt(M_TRIM_THRESHOLD, INT_MAX);
  const auto is_unlimited = [](auto what) {
    rlimit limit;
    return getrlimit(what, &limit) == 0 && limit.rlim_cur == RLIM_INFINITY;
  };
  if (!is_unlimited(RLIMIT_AS) || !is_unlimited(RLIMIT_DATA)) return;
  constexpr int kAddresses = 1 << 30;  // that the heap has at once; pages come when they are used
  constexpr std::uintptr_t kPage = 2 << 20;
  mallopt(M_TOP_PAD, kAddresses);
  void* volatile beyond = std::malloc(kLargest / 2);  // more than is left: the heap grows
  mallopt(M_TOP_PAD, kLargest);
  const auto begin = (reinterpret_cast<std::uintptr_t>(beyond) + kPage - 1) / kPage * kPage;
  const auto end = reinterpret_cast<std::uintptr_t>(sbrk(0)) / kPage * kPage;
  std::free(beyond);
  if (begin < end && end - begin <= 2 * static_cast<std::uintptr_t>(kAddresses))
    (void)madvise(reinterpret_cast<void*>(begin), end - begin, MADV_HUGEPAGE);
#endif
}

void trim_heap() {
#if defined(__GLIBC__) && !defined(MBCOSIM_SANITIZED)
  malloc_trim(0);
#endif
}

}  // namespace mbcosim::cli
