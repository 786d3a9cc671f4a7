#include "wire/memory.h"

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "wire/refusal.h"

namespace mbcosim::server {
namespace {

#if !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)  // there `new` is the sanitizer's

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

}  // namespace
}  // namespace mbcosim::server
