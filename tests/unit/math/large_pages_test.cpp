#include "math/large_pages.h"

#include <gtest/gtest.h>
#include <sys/mman.h>

#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>
#include <sstream>
#include <string>

namespace mbcosim::large_pages_test {
namespace {

/// Memory of its own from the system.
class Mapping {
 public:
  explicit Mapping(std::size_t size)
      : size_(size),
        begin_(static_cast<char*>(
            mmap(nullptr, size, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0))) {}
  ~Mapping() { munmap(begin_, size_); }
  Mapping(const Mapping&) = delete;
  char* get() const { return begin_; }

 private:
  std::size_t size_;
  char* begin_;
};

/// Whether the kernel has been asked for large pages at an address: `hg` in /proc/self/smaps.
bool are_asked_for(const void* address) {
  std::ifstream maps("/proc/self/smaps");
  const auto wanted = reinterpret_cast<std::uintptr_t>(address);
  bool is_inside = false;
  for (std::string line; std::getline(maps, line);) {
    std::uintptr_t begin = 0, end = 0;
    if (std::sscanf(line.c_str(), "%lx-%lx ", &begin, &end) == 2)
      is_inside = begin <= wanted && wanted < end;
    if (!is_inside || line.rfind("VmFlags:", 0) != 0) continue;
    std::istringstream flags(line);
    for (std::string flag; flags >> flag;)
      if (flag == "hg") return true;
  }
  return false;
}

TEST(LargePages, AreAskedForInsideOfLargeMemoryAlone) {
  if (!std::filesystem::exists("/sys/kernel/mm/transparent_hugepage"))
    GTEST_SKIP() << "this kernel has no large pages on request";
  constexpr std::size_t kLarge = 32 << 20, kSmall = 4 << 20, kInside = 4 << 20;
  const auto large = std::make_unique<char[]>(kLarge);
  const Mapping small(kSmall);  // the heap may give memory for which others have asked
  prefer_large_pages(large.get() + 1, kLarge - 1);
  prefer_large_pages(small.get(), kSmall);
  EXPECT_TRUE(are_asked_for(large.get() + kInside));
  EXPECT_FALSE(are_asked_for(small.get() + kSmall / 2));
  prefer_large_pages(nullptr, 0);
}

}  // namespace
}  // namespace mbcosim::large_pages_test
