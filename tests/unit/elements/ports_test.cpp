/// Ports that are elements, what the solver does with loads from outside, and steps in pieces.
#include <gtest/gtest.h>

#include "deck_run.h"
#include "elements/conformance.h"
#include "elements/ports/imposed_motion.h"

namespace mbcosim::ports_test {
namespace {

class Imposed : public testing::TestWithParam<bool> {
 protected:
  void build() {
    ElementPort port;
    port.kind = ElementPort::Kind::motion;
    port.name = "p";
    port.nodes = {bench_.first, bench_.second};
    port.positions_only = GetParam();
    port.input_size = ImposedMotion::kInputs * 2;
    port.output_size = 12;
    port.memory = memory_ = bench_.builder.allocate_memory(port.input_size);
    ElementInfo info;
    info.label = 1;
    add_general_element(bench_.builder, info, std::make_unique<ImposedMotion>(port));
    bench_.finish();
    bench_.generic_state(0.3);
    for (int k = 0; k < 2; ++k) {  // targets near the nodes
      const NodeState node = bench_.model->node_state(bench_.context(bench_.state),
                                                      k == 0 ? bench_.first : bench_.second);
      double* v = &bench_.state.memory[memory_ + ImposedMotion::kInputs * k];
      const Vec3 x = node.x + Vec3(0.1, -0.2, 0.3);
      std::copy(x.data(), x.data() + 3, v);
      Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(v + 3) =
          cgr_rotation(Vec3(0.1, 0.2, -0.1)) * node.R;
    }
  }
  conformance::Bench bench_;
  int memory_ = 0;
};

TEST_P(Imposed, JacobianMatchesCentralDifferences) {
  build();
  const MatX J = bench_.jacobian();
  EXPECT_GT(J.norm(), 1e-4);
  conformance::expect_near(bench_, J, bench_.numerical_jacobian(), 1e-7);
}

INSTANTIATE_TEST_SUITE_P(WithAndWithoutRotations, Imposed, testing::Bool());

// ------------------------------------------------------------------ the engine's side of tight
// coupling

constexpr double kStiffness = 900;

std::string oscillator(const std::string& spring, const std::string& method = "ms, 0.6") {
  const std::string settings = "method: " + method + "; tolerance: 1.e-10; max iterations: 20;";
  return initial_value_block(1e-2, 10, settings) +
         "begin: control data; structural nodes: 2; rigid bodies: 1; joints: " +
         (spring.empty() ? "1" : "2") +
         "; end: control data;\nbegin: nodes; structural: 1, static, null, eye, null, null; "
         "structural: 2, dynamic, 1., 0., 0., eye, 0., 3., "
         "0., null; end: nodes;\nbegin: elements; joint: 1, clamp, 1, node, node; body: 1, 2, 1., "
         "null, eye; " +
         spring + " end: elements;\n";
}

TEST(LoadTangents, TakeTheIterationsOfTheModelThatIsNotCut) {
  DeckRun uncut(oscillator("joint: 2, rod, 1, 2, 1., linear elastic, 900.;"));
  DeckRun cut(oscillator(""));
  ASSERT_TRUE(uncut.ready() && cut.ready());
  Simulation& s = cut.simulation();
  LoadTangent tangent;
  tangent.nodes = {cut.model().find_structural(2)};
  s.set_load_tangents({tangent});
  const int x = s.find_variable("node.structural.2.X"),
            load = s.find_variable("node.structural.2.load");
  s.set_exchange([&](int) {
    std::vector<double> v;
    s.get(x, v);
    const Vec3 d(v[0], v[1], v[2]);
    const double l = d.norm();
    const Vec3 e = d / l, f = -kStiffness * (l - 1) * e;
    const std::vector<double> loads{f(0), f(1), f(2), 0, 0, 0};
    EXPECT_TRUE(s.set(load, loads));
    MatX K = MatX::Zero(6, 6);
    K.topLeftCorner<3, 3>() =
        -kStiffness * (e * e.transpose() + (1 - 1 / l) * (Mat3::Identity() - e * e.transpose()));
    s.load_tangent(0).stiffness = K;
    return true;
  });
  for (int k = 0; k < 50; ++k) {
    const StepReport a = uncut.simulation().step(), b = s.step();
    ASSERT_FALSE(a.error || b.error);
    EXPECT_EQ(a.iterations, b.iterations) << "step " << k;
  }
  EXPECT_LT((uncut.node(2).x - cut.node(2).x).norm(), 1e-10);
}

/// The spring of the oscillator as an external code at each iterate, with or without its tangent.
StepReport run_with_external_spring(const std::string& method, bool with_tangent, Vec3& end) {
  DeckRun run(oscillator("", method));
  Simulation& s = run.simulation();
  LoadTangent tangent;
  tangent.nodes = {run.model().find_structural(2)};
  if (with_tangent) s.set_load_tangents({tangent});
  const int x = s.find_variable("node.structural.2.X"),
            load = s.find_variable("node.structural.2.load");
  Vec3 applied = Vec3::Zero();
  s.set_exchange([&](int) {
    std::vector<double> v;
    s.get(x, v);
    const Vec3 d(v[0], v[1], v[2]);
    const double l = d.norm();
    const Vec3 e = d / l, f = -kStiffness * (l - 1) * e;
    const bool settled = with_tangent || (f - applied).norm() < 1e-9;
    applied = f;
    EXPECT_TRUE(s.set(load, std::vector<double>{f(0), f(1), f(2), 0, 0, 0}));
    if (!with_tangent) return settled;
    s.load_tangent(0).stiffness = MatX::Zero(6, 6);
    s.load_tangent(0).stiffness.topLeftCorner<3, 3>() =
        -kStiffness * (e * e.transpose() + (1 - 1 / l) * (Mat3::Identity() - e * e.transpose()));
    return true;
  });
  const StepReport report = s.step_many(50);
  EXPECT_FALSE(report.error) << (report.error ? report.error->message : "");
  end = run.node(2).x;
  return report;
}

TEST(LoadTangents, ServeTheThirdOrderMethodToo) {
  for (const std::string method : {"third order, .6", "third order, ad hoc"}) {
    Vec3 with, without;
    const StepReport fast = run_with_external_spring(method, true, with),
                     slow = run_with_external_spring(method, false, without);
    EXPECT_LT((with - without).norm(), 1e-9) << method;
    EXPECT_GT((with - Vec3(1, 0, 0)).norm(), 1e-2) << method;
    EXPECT_LE(fast.total_iterations, 3 * 50) << method;  // quadratic
    EXPECT_GT(slow.total_iterations, 2 * fast.total_iterations) << method;
  }
}

// ------------------------------------------------------------------ policies and time

std::string spinning(const std::string& settings, const std::string& spin = "5., 60., 5.") {
  return initial_value_block(0.05, 10, settings) +
         "begin: control data; structural nodes: 1; rigid bodies: 1; end: control data;\nbegin: "
         "nodes; structural: 1, dynamic, null, eye, null, " +
         spin +
         "; end: nodes;\nbegin: elements; body: 1, 1, 1., null, diag, 1., 2., 3.; end: elements;\n";
}

TEST(StepPolicies, PiecesEndWhereTheStepWouldHave) {
  DeckRun run(spinning("tolerance: 1.e-8; max iterations: 4;"));
  Simulation& s = run.simulation();
  const StepReport failed = s.step();
  ASSERT_TRUE(failed.error);
  s.set_policy({StepPolicy::cut, 0});
  std::vector<bool> ends;
  s.set_attempt_ended([&](bool accepted) { ends.push_back(accepted); });
  const StepReport report = s.step();
  ASSERT_FALSE(report.error) << report.error->message;
  EXPECT_GT(report.pieces, 1);
  EXPECT_EQ(report.steps_done, 1);
  EXPECT_EQ(s.step_number(), 1);
  EXPECT_EQ(s.time(), 0.05);
  EXPECT_EQ(s.next_step_size(), 0.05);
  EXPECT_EQ(std::count(ends.begin(), ends.end(), true), report.pieces - 1);
  EXPECT_FALSE(ends.front());
}

TEST(StepPolicies, AFailedCutLeavesTheState) {
  DeckRun run(spinning("tolerance: 1.e-14; max iterations: 1;"));
  Simulation& s = run.simulation();
  const std::string before = s.export_state();
  s.set_policy({StepPolicy::cut, 0.01});
  const StepReport report = s.step();
  ASSERT_TRUE(report.error);
  EXPECT_NE(report.error->message.find("cut down to pieces of 0.0125 s"), std::string::npos)
      << report.error->message;
  EXPECT_EQ(s.export_state(), before);
}

TEST(StepPolicies, AcceptedStepsAreFlagged) {
  DeckRun run(spinning("tolerance: 1.e-14; max iterations: 1;"));
  run.simulation().set_policy({StepPolicy::accept, 0});
  const StepReport report = run.simulation().step();
  EXPECT_FALSE(report.error);
  EXPECT_TRUE(report.flagged);
  EXPECT_EQ(run.simulation().step_number(), 1);
}

TEST(TimeKeeping, ExactTimeDoesNotDrift) {
  const std::map<std::string, std::string> files{
      {"deck", spinning("tolerance: 1.e-8; max iterations: 50;", "0.1, 1., 0.1")}};
  const LoadReport report = load_deck(BundleSource(files), "deck");
  ASSERT_TRUE(report.ok());
  auto exact = Simulation::create(report.model, nullptr, nullptr, TimeKeeping::exact);
  auto summed = Simulation::create(report.model);
  ASSERT_TRUE(exact && summed);
  double sum = 0;
  for (int k = 1; k <= 100; ++k) {
    ASSERT_FALSE((*exact)->step().error || (*summed)->step().error);
    sum += 0.05;
    EXPECT_EQ((*exact)->time(), k * 0.05);
    EXPECT_EQ((*summed)->time(), sum);
  }
}

// ------------------------------------------------------------------ attachments

TEST(Attachments, AreRefusedWithTheirReason) {
  const std::map<std::string, std::string> files{{"deck", spinning("")}};
  const auto refusal = [&](PortAttachment a) {
    const LoadReport report = load_deck(BundleSource(files), "deck", {}, {std::move(a)});
    EXPECT_FALSE(report.ok());
    return report.diagnostics.empty() ? std::string() : report.diagnostics.back().message;
  };
  const auto motion = ElementPort::Kind::motion;
  EXPECT_NE(refusal({motion, "a", {5}, false, 0}).find("no structural node 5"), std::string::npos);
  EXPECT_NE(refusal({motion, "a", {1, 1}, false, 0}).find("listed twice"), std::string::npos);
  EXPECT_NE(refusal({ElementPort::Kind::modal, "a", {}, false, 2}).find("no modal joint 2"),
            std::string::npos);
}

}  // namespace
}  // namespace mbcosim::ports_test
