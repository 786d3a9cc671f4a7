#include "wire/heap_trim.h"

#include <gtest/gtest.h>

#include <cstring>
#include <memory>
#include <vector>

namespace mbcosim::server::heap_trim_test {
namespace {

using std::chrono::milliseconds;

class HeapTrimTest : public testing::Test {
 protected:
  /// Whether memory is given back at that time.
  bool at(int ms) { return trim.look(start + milliseconds(ms)); }

  static constexpr std::int64_t kMb = 1 << 20;
  const HeapTrim::Clock::time_point start = HeapTrim::Clock::now();
  MemoryBudget budget{1 << 30};
  HeapTrim trim{budget};
};

TEST_F(HeapTrimTest, ComesOnceSomeTimeAfterMuchWasFreed) {
  MemoryShare share(budget, 100 * kMb);
  EXPECT_FALSE(at(0));
  share = {};
  EXPECT_FALSE(at(100));
  EXPECT_FALSE(at(1500));
  EXPECT_TRUE(at(1700));
  EXPECT_FALSE(at(10000));
}

TEST_F(HeapTrimTest, ManySmallOnesAreMuch) {
  std::vector<MemoryShare> shares;
  for (int k = 0; k < 10; ++k) shares.emplace_back(budget, 10 * kMb);
  EXPECT_FALSE(at(0));
  for (int ms = 100; !shares.empty(); ms += 100) {
    shares.pop_back();
    EXPECT_FALSE(at(ms));
  }
  EXPECT_FALSE(at(1900));
  EXPECT_TRUE(at(2300));
}

TEST_F(HeapTrimTest, LittleIsKept) {
  for (int ms = 0; ms < 10000; ms += 200) {
    const MemoryShare share(budget, 60 * kMb);
    EXPECT_FALSE(at(ms));
  }
  EXPECT_FALSE(at(20000));
}

TEST_F(HeapTrimTest, ComesThreeTimesWhenItIsAsked) {
  trim.ask(start);
  int times = 0;
  for (int ms = 0; ms < 20000; ms += 100) times += at(ms);
  EXPECT_EQ(times, 3);
}

#ifndef MBCOSIM_SANITIZED  // there `new` is the sanitizer's
using Pieces = std::vector<std::unique_ptr<char[]>>;

/// None is mapped by itself.
Pieces resident_pieces(std::int64_t bytes) {
  constexpr std::size_t kSize = 64 << 10;
  Pieces pieces;
  for (std::int64_t k = 0; k < bytes / static_cast<std::int64_t>(kSize); ++k) {
    pieces.push_back(std::make_unique<char[]>(kSize));
    std::memset(pieces.back().get(), 1, kSize);
  }
  return pieces;
}

TEST_F(HeapTrimTest, WhatNoBudgetCountsGoesBackWheneverItWasFreed) {
  EXPECT_FALSE(at(0));
  Pieces pieces = resident_pieces(200 * kMb);
  const Pieces last = resident_pieces(kMb);
  EXPECT_FALSE(at(20000));
  EXPECT_TRUE(at(22000));  // in vain
  const std::int64_t before = resident_bytes();
  pieces.clear();
  EXPECT_FALSE(at(40500));
  EXPECT_TRUE(at(42100));
  EXPECT_LT(resident_bytes(), before - 150 * kMb);
  EXPECT_FALSE(at(61000));
  EXPECT_FALSE(at(63000));
}

TEST_F(HeapTrimTest, WhatWasFreedBetweenOthersGoesBackToTheSystem) {
  Pieces pieces = resident_pieces(128 * kMb);
  const Pieces last = resident_pieces(kMb);
  const std::int64_t before = resident_bytes();
  pieces.clear();
  const std::int64_t kept = resident_bytes();
  trim.ask(start);
  EXPECT_TRUE(at(2000));
  EXPECT_LT(resident_bytes(), before - 100 * kMb);
  EXPECT_LE(resident_bytes(), kept);
}
#endif

}  // namespace
}  // namespace mbcosim::server::heap_trim_test
