#include "cli/heap.h"

#include <link.h>
#include <malloc.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "math/large_pages.h"

/// The program as the linker has placed it: its code, its constants and tables for exceptions in a
/// row; its variables.
extern "C" const char __executable_start, __data_start, end;

namespace mbcosim::cli {

#if defined(__GLIBC__) && !defined(MBCOSIM_SANITIZED)
namespace {

constexpr std::size_t kLeast = std::size_t{1} << 30, kFirst = 512 << 10, kStack = 48 << 10;
constexpr int kStep = 32 << 20;  ///< also the largest threshold of glibc

void keep_what_is_freed() {
  constexpr int kNever = -1;
  mallopt(M_TRIM_THRESHOLD, kNever);
  mallopt(M_MMAP_THRESHOLD, kStep);
}

std::uintptr_t address_of(const void* place) { return reinterpret_cast<std::uintptr_t>(place); }

/// All pages that have some of these bytes. A kernel that cannot leaves them to be touched.
void get_pages(std::uintptr_t begin, std::uintptr_t end, int how) {
  const auto page = static_cast<std::uintptr_t>(sysconf(_SC_PAGESIZE));
  begin = begin / page * page;
  (void)madvise(reinterpret_cast<void*>(begin), end - begin, how);
}

/// Where the tables for exceptions begin.
int find_tables(dl_phdr_info* program, std::size_t, void* found) {
  for (int k = 0; k < program->dlpi_phnum; ++k)
    if (const ElfW(Phdr)& part = program->dlpi_phdr[k]; part.p_type == PT_GNU_EH_FRAME)
      *static_cast<std::uintptr_t*>(found) = program->dlpi_addr + part.p_vaddr;
  return 1;  // the program itself is the first
}

/// Before what other files have done before `main`.
[[gnu::constructor(101)]] void get_program() {
  std::uintptr_t tables = 0;
  dl_iterate_phdr(&find_tables, &tables);
  if (tables != 0) get_pages(address_of(&__executable_start), tables, MADV_POPULATE_READ);
  get_pages(address_of(&__data_start), address_of(&end), MADV_POPULATE_WRITE);
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
  const char here = 0;  // below it the stack grows
  get_pages(address_of(&here) - kStack, address_of(&here), MADV_POPULATE_WRITE);
  char* volatile first = static_cast<char*>(std::malloc(kFirst));
  if (first) get_pages(address_of(first), address_of(first + kFirst), MADV_POPULATE_WRITE);
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
