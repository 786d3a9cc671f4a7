/// Factorizations of a step are counted: beyond the budget the step fails and the session goes on.
#include <gtest/gtest.h>

#include <string>

#include "service/session.h"
#include "simulation/simulation.h"

namespace mbcosim::server {
namespace {

#if !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)  // there `new` is the sanitizer's

/// A cube of 8³ masses between rods, 3072 unknowns. One rod more from t = 2.5 ms on makes a matrix
/// of another kind, which is factored anew.
std::string cube() {
  constexpr int kSide = 8;
  std::string nodes, elements;
  int rods = 0;
  const auto label = [](int i, int j, int k) {
    return std::to_string(1 + i + kSide * (j + kSide * k));
  };
  const auto rod = [&](const std::string& a, const std::string& b) {
    return "joint: " + std::to_string(++rods) + ", rod, " + a + ", " + b +
           ", from nodes, linear viscoelastic, 1e3, 1.;\n";
  };
  for (int k = 0; k < kSide; ++k)
    for (int j = 0; j < kSide; ++j)
      for (int i = 0; i < kSide; ++i) {
        const std::string self = label(i, j, k);
        nodes += "structural: " + self + ", dynamic displacement, " + std::to_string(i) + ".," +
                 std::to_string(j) + ".," + std::to_string(k) + "., null;\n";
        elements += "body: " + self + ", " + self + ", 1.;\n";
        if (i + 1 < kSide) elements += rod(self, label(i + 1, j, k));
        if (j + 1 < kSide) elements += rod(self, label(i, j + 1, k));
        if (k + 1 < kSide) elements += rod(self, label(i, j, k + 1));
      }
  const std::string last = rod(label(0, 0, 0), label(7, 7, 7));
  elements += "driven: " + std::to_string(rods) + ", string, \"Time > .0025\", " + last;
  return "begin: data; problem: initial value; end: data;\nbegin: initial value; initial time: 0.; "
         "final time: 1.; time step: 1e-3; method: ms, .6; tolerance: 1e-6; max iterations: 20; "
         "derivatives tolerance: 1.; end: initial value;\nbegin: control data; structural nodes: "
         "512; rigid bodies: 512; joints: " +
         std::to_string(rods) + "; end: control data;\nbegin: nodes;\n" + nodes +
         "end: nodes;\nbegin: elements;\n" + elements + "end: elements;\n";
}

std::unique_ptr<Simulation> simulation_of_cube() {
  const LoadReport report =
      load_deck(BundleSource(std::map<std::string, std::string>{{"deck.mbd", cube()}}), "deck.mbd");
  for (const Diagnostic& d : report.diagnostics) EXPECT_NE(d.severity, Severity::error) << d.text();
  if (!report.ok()) return nullptr;
  auto created = Simulation::create(report.model);
  EXPECT_TRUE(created) << created.error().message;
  return created ? std::move(*created) : nullptr;
}

class SessionMemory : public testing::Test {
 protected:
  v1::StepReply step(std::int64_t budget, int steps, std::int64_t* used) {
    MemoryBudget memory{budget};
    auto simulation = simulation_of_cube();
    if (!simulation) return {};
    Session session({}, {}, std::move(simulation),
                    {slots_, limits_, metrics_, log_, memory, lanes_, timer_});
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
  Lanes lanes_{1, 1};
  Timer timer_;
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
}  // namespace mbcosim::server
