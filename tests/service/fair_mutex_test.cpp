#include "service/fair_mutex.h"

#include <gtest/gtest.h>

#include <atomic>
#include <thread>
#include <vector>

namespace mbcosim::server {
namespace {

TEST(FairMutex, ServesAWaiterThoughTheHolderComesBackAtOnce) {
  FairMutex mutex;
  std::atomic<bool> waiting{false}, served{false};
  mutex.lock();
  std::thread waiter([&] {
    waiting = true;
    mutex.lock();
    served = true;
    mutex.unlock();
  });
  while (!waiting || !mutex.contended()) std::this_thread::yield();
  mutex.unlock();
  mutex.lock();  // queues behind the waiter
  EXPECT_TRUE(served);
  mutex.unlock();
  waiter.join();
}

TEST(FairMutex, TryLockFailsWhileLocked) {
  FairMutex mutex;
  ASSERT_TRUE(mutex.try_lock());
  EXPECT_FALSE(mutex.try_lock());
  mutex.unlock();
  EXPECT_TRUE(mutex.try_lock());
  mutex.unlock();
}

TEST(SolverSlots, NeverGrantsMoreThanItHas) {
  SolverSlots slots(2);
  std::atomic<int> inside{0}, most{0};
  std::vector<std::thread> threads;
  for (int k = 0; k < 6; ++k) {
    threads.emplace_back([&] {
      for (int i = 0; i < 200; ++i) {
        const CancelToken token;
        const auto slot = slots.acquire(token);
        ASSERT_TRUE(slot);
        const int now = ++inside;
        int before = most.load();
        while (before < now && !most.compare_exchange_weak(before, now)) {
        }
        --inside;
      }
    });
  }
  for (auto& thread : threads) thread.join();
  EXPECT_LE(most, 2);
}

TEST(SolverSlots, ACancelledWaitEndsWithoutASlot) {
  SolverSlots slots(1);
  CancelToken token;
  const auto held = slots.acquire(token);
  CancelToken cancelled;
  cancelled.cancel();
  EXPECT_FALSE(slots.acquire(cancelled));
}

}  // namespace
}  // namespace mbcosim::server
