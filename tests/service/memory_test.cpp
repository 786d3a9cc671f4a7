#include "wire/memory.h"
#include "host/control_group.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <limits>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "wire/refusal.h"

namespace mbcosim::server::memory_test {
namespace {

#ifndef MBCOSIM_SANITIZED  // there `new` is the sanitizer's

template <class Body>
std::string limit_of_refusal(Body&& body) {
  try {
    body();
  } catch (const Refusal& refusal) {
    return reason_name(refusal.reason());
  }
  return "";
}

TEST(Memory, WorkBeyondTheBudgetIsRefusedAndLeavesNothingTaken) {
  MemoryBudget budget(8 << 20);
  const auto too_much = [&] {
    within(budget, nullptr, nullptr, [] {
      std::vector<std::string> strings;
      for (;;) strings.emplace_back(1000, 'x');
      return 0;
    });
  };
  EXPECT_EQ(limit_of_refusal(too_much), "LIMIT_EXCEEDED");
  EXPECT_EQ(budget.used(), 0);
  EXPECT_EQ(limit_of_refusal(too_much), "LIMIT_EXCEEDED");
}

TEST(Memory, WhatWorkLeavesBehindStaysCountedUntilItsEnd) {
  MemoryBudget budget(64 << 20);
  MemoryShare share;
  const auto kept = within(budget, nullptr, &share, [] {
    const std::vector<char> scratch(20 << 20);
    return std::make_unique<std::vector<char>>(10 << 20);
  });
  EXPECT_GE(share.bytes(), 10 << 20);
  EXPECT_LT(share.bytes(), 12 << 20);
  EXPECT_EQ(budget.used(), share.bytes());
  share = MemoryShare();
  EXPECT_EQ(budget.used(), 0);
}

TEST(Memory, WhatACallbackTakesIsNotCounted) {
  MemoryBudget budget(64 << 20);
  MemoryShare share;
  const auto kept = within(budget, nullptr, &share, [] {
    const MemoryPause uncounted;
    return std::make_unique<std::vector<char>>(10 << 20);
  });
  EXPECT_LT(share.bytes(), 1 << 20);
}

TEST(Memory, CancelledWorkEndsThoughItNeverLooks) {
  MemoryBudget budget(1LL << 40);
  CancelToken token;
  token.cancel();
  EXPECT_EQ(limit_of_refusal([&] {
              within(budget, &token, nullptr, [] {
                for (;;) std::make_unique<std::string>(100, 'x');
                return 0;
              });
            }),
            "CANCELLED");
}

#endif

TEST(Memory, SharesGrowUpToTheBudgetAndGiveBack) {
  MemoryBudget budget(100);
  {
    MemoryShare share(budget, 60);
    EXPECT_THROW(share.grow(41), Refusal);
    share.grow(40);
    EXPECT_EQ(budget.used(), 100);
    const MemoryShare moved = std::move(share);
    EXPECT_EQ(budget.used(), 100);
  }
  EXPECT_EQ(budget.used(), 0);
}

TEST(Memory, WhatIsThereAlreadyIsNeverRefused) {
  MemoryBudget budget(100);
  {
    MemoryShare share(budget);
    share.change(150);
    EXPECT_EQ(budget.used(), 150);
    EXPECT_THROW(MemoryShare(budget, 1), Refusal);
    share.change(-200);
    EXPECT_EQ(share.bytes(), 0);
  }
  EXPECT_EQ(budget.used(), 0);
}

/// A folder with what the system tells a process about its control groups.
class ControlGroups : public testing::Test {
 protected:
  ~ControlGroups() override { std::filesystem::remove_all(root_); }
  void write(const std::string& path, const std::string& text) const {
    std::filesystem::create_directories((root_ / path).parent_path());
    std::ofstream(root_ / path) << text << '\n';
  }
  std::int64_t limit() const { return control_group_memory(root_.string()); }
  double processors() const { return control_group_processors(root_.string()); }
  static constexpr std::int64_t kNone = std::numeric_limits<std::int64_t>::max();

 private:
  static std::filesystem::path fresh_folder() {
    std::string name = testing::TempDir() + "/control_groups_XXXXXX";
    return ::mkdtemp(name.data());
  }
  const std::filesystem::path root_ = fresh_folder();
};

TEST_F(ControlGroups, WithoutAnyNothingIsLimited) {
  EXPECT_EQ(limit(), kNone);
  write("proc/self/cgroup", "0::/");
  EXPECT_EQ(limit(), kNone);
}

TEST_F(ControlGroups, OfAServiceTheSmallestLimitUpToTheRootHolds) {
  write("proc/self/cgroup", "0::/system.slice/mbcosimd.service");
  write("sys/fs/cgroup/system.slice/mbcosimd.service/memory.max", "max");
  write("sys/fs/cgroup/system.slice/other.service/memory.max", "1000");
  EXPECT_EQ(limit(), kNone);
  write("sys/fs/cgroup/system.slice/memory.max", "8000000000");
  EXPECT_EQ(limit(), 8000000000);
  write("sys/fs/cgroup/system.slice/mbcosimd.service/memory.max", "2000000000");
  EXPECT_EQ(limit(), 2000000000);
}

TEST_F(ControlGroups, OfAContainerThatSeesItsHostsPathItsOwnRootHolds) {
  write("proc/self/cgroup", "0::/../../kubepods/pod7");
  write("sys/fs/cgroup/memory.max", "3000000000");
  EXPECT_EQ(limit(), 3000000000);
}

TEST_F(ControlGroups, OfTheOlderVersionTheGroupOfMemoryHolds) {
  write("proc/self/cgroup", "9:cpu,cpuacct:/wrong\n4:memory:/service/one\n0::/unified");
  write("sys/fs/cgroup/memory/wrong/memory.limit_in_bytes", "1000");
  write("sys/fs/cgroup/memory/memory.limit_in_bytes", "9223372036854771712");
  write("sys/fs/cgroup/memory/service/one/memory.limit_in_bytes", "5000000000");
  EXPECT_EQ(limit(), 5000000000);
}

TEST_F(ControlGroups, WithoutAnyAllProcessorsAreUsable) {
  write("proc/self/cgroup", "0::/");
  EXPECT_EQ(processors(), std::numeric_limits<double>::infinity());
  EXPECT_GE(usable_cores(), 1);
  EXPECT_LE(usable_cores(), static_cast<int>(std::thread::hardware_concurrency()));
}

TEST_F(ControlGroups, OfAServiceTheSmallestShareOfProcessorsHolds) {
  write("proc/self/cgroup", "0::/system.slice/mbcosimd.service");
  write("sys/fs/cgroup/system.slice/mbcosimd.service/cpu.max", "max 100000");
  EXPECT_EQ(processors(), std::numeric_limits<double>::infinity());
  write("sys/fs/cgroup/system.slice/cpu.max", "400000 100000");
  EXPECT_EQ(processors(), 4);
  write("sys/fs/cgroup/system.slice/mbcosimd.service/cpu.max", "75000 50000");
  EXPECT_EQ(processors(), 1.5);
}

TEST_F(ControlGroups, OfTheOlderVersionTheGroupOfProcessorsHolds) {
  write("proc/self/cgroup", "9:cpu,cpuacct:/service/one\n4:memory:/wrong\n0::/unified");
  write("sys/fs/cgroup/cpu/cpu.cfs_quota_us", "-1");
  write("sys/fs/cgroup/cpu/cpu.cfs_period_us", "100000");
  write("sys/fs/cgroup/cpu/wrong/cpu.cfs_quota_us", "1000");
  write("sys/fs/cgroup/cpu/wrong/cpu.cfs_period_us", "100000");
  EXPECT_EQ(processors(), std::numeric_limits<double>::infinity());
  write("sys/fs/cgroup/cpu/service/one/cpu.cfs_quota_us", "250000");
  write("sys/fs/cgroup/cpu/service/one/cpu.cfs_period_us", "100000");
  EXPECT_EQ(processors(), 2.5);
}

}  // namespace
}  // namespace mbcosim::server::memory_test
