#include "service/fair_mutex.h"
#include "wire/refusal.h"

#include <gtest/gtest.h>

#include <atomic>
#include <optional>
#include <string>
#include <thread>
#include <vector>

namespace mbcosim::server::fair_mutex_test {
namespace {

const std::string kOwner = "local";

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

TEST(FairMutex, AnEndedCallWaitsNoLongerAndHoldsUpNobody) {
  FairMutex mutex;
  Call call;
  mutex.lock();
  std::atomic<bool> gave_up{false}, served{false};
  std::thread hasty([&] { gave_up = !mutex.lock_for(call); });
  while (!mutex.contended()) std::this_thread::yield();
  std::thread patient([&] {
    const Guard lock(mutex);
    served = true;
  });
  call.cancel();
  hasty.join();
  EXPECT_TRUE(gave_up);
  EXPECT_FALSE(served);
  mutex.unlock();
  patient.join();
  EXPECT_TRUE(served);
}

TEST(FairMutex, ACallGuardHoldsTheLockOrThrows) {
  FairMutex mutex;
  Call call;
  {
    const CallGuard lock(mutex, call);
    EXPECT_FALSE(mutex.try_lock());
    call.cancel();
    EXPECT_THROW(CallGuard(mutex, call), Refusal);
  }
  EXPECT_TRUE(mutex.try_lock()) << "the ticket that was given up is passed over";
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
        const auto slot = slots.acquire(kOwner, token);
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
  const auto held = slots.acquire(kOwner, token);
  CancelToken cancelled;
  cancelled.cancel();
  EXPECT_FALSE(slots.acquire(kOwner, cancelled));
}

/// A step of a large model may take long: whoever has no other slot does not wait for its end.
TEST(SolverSlots, AnOwnerWithoutASlotGetsOneAtOnce) {
  const std::string other = "token:other";
  SolverSlots slots(2);
  CancelToken token, cancelled;
  cancelled.cancel();
  const auto first = slots.acquire(kOwner, token), second = slots.acquire(kOwner, token);
  EXPECT_FALSE(slots.acquire(kOwner, cancelled)) << "the owner has its share";
  {
    const auto beyond = slots.acquire(other, cancelled);
    EXPECT_TRUE(beyond);
    EXPECT_FALSE(slots.acquire(other, cancelled)) << "one, not more";
  }
  EXPECT_FALSE(slots.acquire(kOwner, cancelled)) << "what was beyond the number is gone";
}

TEST(SolverSlots, AWaiterGetsTheSlotThatItsOwnerGivesBack) {
  const std::string other = "token:other";
  SolverSlots slots(1);
  const CancelToken token;
  const auto held = slots.acquire(kOwner, token);
  std::optional<SolverSlots::Slot> beyond(slots.acquire(other, token));
  std::atomic<bool> granted{false};
  std::thread waiter([&] { granted = bool(slots.acquire(other, token)); });
  while (slots.waiting() == 0) std::this_thread::yield();
  beyond.reset();
  waiter.join();
  EXPECT_TRUE(granted) << "though the pool is still beyond its number";
}

}  // namespace
}  // namespace mbcosim::server::fair_mutex_test
