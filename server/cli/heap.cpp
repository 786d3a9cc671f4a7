#include "cli/heap.h"

#include <malloc.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cstddef>
#include <cstdlib>

#include "math/large_pages.h"

namespace mbcosim::cli {

#if defined(__GLIBC__) && !defined(MBCOSIM_SANITIZED)
namespace {

constexpr std::size_t kLeast = std::size_t{1} << 30;

/// Addresses that the heap has at once; pages come when they are used.
std::size_t addresses() {
  const auto pages = sysconf(_SC_PHYS_PAGES), size = sysconf(_SC_PAGESIZE);
  return pages > 0 && size > 0 ? std::max(kLeast, std::size_t(pages) / 2 * std::size_t(size))
                               : kLeast;
}

bool is_unlimited(int what) {
  rlimit limit;
  return getrlimit(static_cast<__rlimit_resource>(what), &limit) == 0 &&
         limit.rlim_cur == RLIM_INFINITY;
}

}  // namespace
#endif

void keep_heap() {
#if defined(__GLIBC__) && !defined(MBCOSIM_SANITIZED)
  constexpr int kNever = -1, kStep = 32 << 20;  // the latter also the largest threshold of glibc
  mallopt(M_TRIM_THRESHOLD, kNever);
  mallopt(M_MMAP_THRESHOLD, kStep);
  mallopt(M_TOP_PAD, kStep);
  if (!is_unlimited(RLIMIT_AS) || !is_unlimited(RLIMIT_DATA)) return;
  mallopt(M_MMAP_MAX, 0);
  const std::size_t wanted = addresses();
  char* volatile beyond = static_cast<char*>(std::malloc(wanted));  // more than is left: it grows
  char* const begin = beyond;
  const char* const end = static_cast<char*>(sbrk(0));
  std::free(beyond);
  if (begin && begin < end && static_cast<std::size_t>(end - begin) <= 2 * wanted)
    prefer_large_pages(begin, end - begin);
#endif
}

void trim_heap() {
#if defined(__GLIBC__) && !defined(MBCOSIM_SANITIZED)
  malloc_trim(0);
#endif
}

}  // namespace mbcosim::cli
