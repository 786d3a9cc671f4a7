/// Factorizations of a step are counted: beyond the budget the step fails and the session goes on.
#include <gtest/gtest.h>

#include <string>

#include "rod_cube.h"
#include "rpc/workers.h"
#include "service/session.h"

namespace mbcosim::server::session_memory_test {
namespace {

#ifndef MBCOSIM_SANITIZED  // there `new` is the sanitizer's

class SessionMemory : public testing::Test {
 protected:
  v1::StepReply step(std::int64_t budget, int steps, std::int64_t* used) {
    MemoryBudget memory{budget};
    auto simulation = rod_cube();
    if (!simulation) return {};
    Session session({}, {}, std::move(simulation),
                    {slots_, limits_, metrics_, log_, memory, workers_.lanes, workers_.timer});
    session.set_memory(MemoryShare(memory));
    v1::StepRequest request;
    request.set_steps(steps);
    v1::StepReply reply;
    Call call;
    session.step(request, Caller{"local", Role::admin}, call, &reply);
    *used = memory.used();
    return reply;
  }

  SolverSlots slots_{1};
  ServiceLimits limits_;
  Metrics metrics_;
  EventLog log_;
  Workers workers_{1, 1};
};

TEST_F(SessionMemory, AFactorizationOfAStepIsCounted) {
  std::int64_t before = 0, after = 0;
  EXPECT_EQ(step(1 << 30, 2, &before).steps_done(), 2);
  EXPECT_EQ(step(1 << 30, 4, &after).steps_done(), 4);
  EXPECT_GT(after, before + (1 << 20));
}

TEST_F(SessionMemory, AStepBeyondTheBudgetEndsAtItsStart) {
  std::int64_t used = 0;
  const v1::StepReply reply = step(2 << 20, 4, &used);
  EXPECT_EQ(reply.outcome(), v1::STEP_OUTCOME_LIMIT);
  EXPECT_EQ(reply.steps_done(), 2);
  EXPECT_EQ(reply.step(), 2);
  EXPECT_EQ(reply.failure().reason(), v1::REASON_LIMIT_EXCEEDED);
  EXPECT_NE(reply.failure().message().find("memory"), std::string::npos)
      << reply.failure().message();
  EXPECT_LE(used, 2 << 20);
}

#endif

}  // namespace
}  // namespace mbcosim::server::session_memory_test
