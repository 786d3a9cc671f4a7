#include "cli/heap.h"

#include <malloc.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "math/large_pages.h"

/// The program's code, as the linker has placed it.
extern "C" const char __executable_start, etext;

namespace mbcosim::cli {

#if defined(__GLIBC__) && !defined(MBCOSIM_SANITIZED)
namespace {

constexpr std::size_t kLeast = std::size_t{1} << 30, kFirst = 512 << 10;
constexpr int kStep = 32 << 20;  ///< also the largest threshold of glibc

void keep_what_is_freed() {
  constexpr int kNever = -1;
  mallopt(M_TRIM_THRESHOLD, kNever);
  mallopt(M_MMAP_THRESHOLD, kStep);
}

/// All pages that have some of these bytes. A kernel that cannot leaves them to be touched.
void get_pages(const char* begin, const char* end, int how) {
  const auto page = static_cast<std::uintptr_t>(sysconf(_SC_PAGESIZE));
  const auto from = reinterpret_cast<std::uintptr_t>(begin) / page * page;
  (void)madvise(reinterpret_cast<void*>(from), reinterpret_cast<std::uintptr_t>(end) - from, how);
}

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

void begin_heap() {
#if defined(__GLIBC__) && !defined(MBCOSIM_SANITIZED)
  keep_what_is_freed();
  get_pages(&__executable_start, &etext, MADV_POPULATE_READ);
  char* volatile first = static_cast<char*>(std::malloc(kFirst));
  if (first) get_pages(first, first + kFirst, MADV_POPULATE_WRITE);
  std::free(first);
#endif
}

void keep_heap() {
#if defined(__GLIBC__) && !defined(MBCOSIM_SANITIZED)
  keep_what_is_freed();
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
