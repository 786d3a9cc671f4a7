/// Loads of external codes: equations, derivatives, the card.
#include "elements/ports/external_structural.h"

#include <gtest/gtest.h>

#include "deck_run.h"
#include "elements/conformance.h"

namespace mbcosim::external_structural_test {
namespace {

/// Two points on the first node, one on the second, a third node as reference.
class ExternalLoads : public testing::Test {
 protected:
  /// `more`: nodes with a point each.
  void build(bool use_reference_loads, int more = 0) {
    reference_ = bench_.add_node(StructuralKind::static_);
    StructuralPort port;
    port.nodes = {bench_.first, bench_.first, bench_.second};
    for (int k = 0; k < more; ++k) port.nodes.push_back(bench_.add_node(StructuralKind::static_));
    for (int k = 0; k < 3 + more; ++k) port.offsets.push_back(bench_.vec());
    port.reference = reference_;
    port.use_reference_loads = use_reference_loads;
    port.memory = bench_.builder.allocate_memory(port.load_size());
    for (int k = 0; k < port.load_size(); ++k)
      bench_.builder.set_memory(port.memory + k, bench_.number());
    ElementInfo info;
    info.label = 1;
    add_general_element(bench_.builder, info, std::make_unique<ExternalStructural>(port, false));
    bench_.finish();
    bench_.generic_state(0.3);
    port_ = port;
  }
  Vec3 load(int k, int offset) const {
    return Vec3(&bench_.state.memory[port_.memory + 6 * k + offset]);
  }
  NodeState at(int node) const {
    return bench_.model->node_state(bench_.context(bench_.state), node);
  }
  Vec3 row(const VecX& r, int node, int offset) const {
    return Vec3(r.data() + bench_.model->structural[node].equilibrium + offset);
  }

  conformance::Bench bench_;
  StructuralPort port_;
  int reference_ = -1;
};

TEST_F(ExternalLoads, JacobianMatchesCentralDifferences) {
  build(true);
  const MatX J = bench_.jacobian();
  EXPECT_GT(J.norm(), 1e-4);
  conformance::expect_near(bench_, J, bench_.numerical_jacobian(), 1e-7);
}

TEST_F(ExternalLoads, JacobianOfManyNodesMatchesCentralDifferences) {  // of which a part is kept
  build(true, 30);
  const MatX J = bench_.jacobian();
  EXPECT_GT(J.norm(), 1e-4);
  conformance::expect_near(bench_, J, bench_.numerical_jacobian(), 1e-7);
}

TEST_F(ExternalLoads, PointsOfOneNodeAddUp) {
  build(false);
  const VecX r = bench_.residual(bench_.state);
  const NodeState node = at(bench_.first);
  Vec3 moment = Vec3::Zero();
  for (int k = 0; k < 2; ++k) moment += load(k, 3) + (node.R * port_.offsets[k]).cross(load(k, 0));
  EXPECT_LT((row(r, bench_.first, 0) - load(0, 0) - load(1, 0)).norm(), 1e-14);
  EXPECT_LT((row(r, bench_.first, 3) - moment).norm(), 1e-14);
  EXPECT_EQ(row(r, reference_, 0), Vec3::Zero());
}

TEST_F(ExternalLoads, AllLoadsTogetherAreTheTotalOnTheReferenceNode) {
  build(true);
  const VecX r = bench_.residual(bench_.state);
  Vec3 force = Vec3::Zero(), moment = Vec3::Zero();  // about the reference node
  for (const int node : {bench_.first, bench_.second, reference_}) {
    force += row(r, node, 0);
    moment += row(r, node, 3) + (at(node).x - at(reference_).x).cross(row(r, node, 0));
  }
  EXPECT_LT((force - load(3, 0)).norm(), 1e-14);
  EXPECT_LT((moment - load(3, 3)).norm(), 1e-14);
}

// ------------------------------------------------------------------ the card

std::string deck(const std::string& force) {
  return initial_value_block(1e-3, 1, "method: ms, 0.6; tolerance: 1.e-9; max iterations: 20;") +
         "begin: control data; structural nodes: 2; rigid bodies: 2; forces: 1; end: control data;"
         "begin: nodes; structural: 1, dynamic, null, eye, null, null;"
         "structural: 2, dynamic, 1., 0., 0., eye, null, null; end: nodes;"
         "begin: elements; body: 1, 1, 2., null, diag, 1., 1., 1.; body: 2, 2, 1., null, diag, 1., "
         "1., 1.;"
         "force: 5, external structural, " +
         force + "; end: elements;";
}

std::string refusal(const std::string& force) {
  const LoadReport report = load_deck(BundleSource({{"deck.mbd", deck(force)}}), "deck.mbd");
  EXPECT_FALSE(report.ok());
  for (const Diagnostic& d : report.diagnostics)
    if (d.severity == Severity::error) return d.message;
  return "";
}

TEST(ExternalStructuralCard, DeclaresAPortAndAnInput) {
  DeckRun run(
      deck("grpc, port, \"wing\", sleep time, 0.1, precision, 16, coupling, tight, send after "
           "predict, no, "
           "labels, yes, sorted, no, orientation, euler 123, accelerations, yes, "
           "2, 1, offset, 0., 1., 0., 2, label, 77"));
  ASSERT_TRUE(run.ready());
  const StructuralPort& port = run.model().structural_ports.at(0);
  EXPECT_EQ(port.name, "wing");
  EXPECT_EQ(port.coupling, PortCoupling::tight);
  EXPECT_EQ(port.orientation, OrientationDescription::euler123);
  EXPECT_TRUE(port.accelerations);
  EXPECT_EQ(port.point_labels, (std::vector<int>{1, 77}));
  EXPECT_EQ(port.offsets[0], Vec3(0, 1, 0));
  const int loads = run.simulation().find_variable("port.wing.loads");
  ASSERT_GE(loads, 0);
  const std::vector<double> values = {4, 0, 0, 0, 0, 0, 0, 0, 3, 0, 0, 0};
  ASSERT_TRUE(run.simulation().set(loads, values));
  run.step(100);
  std::vector<double> back;
  run.simulation().get(loads, back);
  EXPECT_EQ(back, values);
  // A load that starts with a step acts during a part of it only: up to one step's impulse is
  // missing.
  EXPECT_NEAR(run.node(1).v.x(), 2 * 0.1, 2e-3);
  EXPECT_NEAR(run.node(1).w.z(), -4 * 0.1, 6e-3);  // (0, 1, 0) × (4, 0, 0) over J = 1
  EXPECT_NEAR(run.node(2).v.z(), 3 * 0.1, 3e-3);
}

TEST(ExternalStructuralCard, SocketsBecomeAPortNamedAfterTheLabel) {
  DeckRun run(
      deck("socket, create, yes, path, \"/tmp/x.sock\", no signal, coupling, staggered, 1, 2"));
  ASSERT_TRUE(run.ready());
  EXPECT_EQ(run.model().structural_ports.at(0).name, "external5");
  EXPECT_EQ(run.model().structural_ports.at(0).coupling, PortCoupling::staggered);
}

TEST(ExternalStructuralCard, AReferenceNodeTakesTheTotalUnlessToldOtherwise) {
  DeckRun with(deck("grpc, port, \"a\", reference node, 1, 1, 2"));
  ASSERT_TRUE(with.ready());
  EXPECT_TRUE(with.model().structural_ports.at(0).use_reference_loads);
  DeckRun without(
      deck("grpc, port, \"a\", reference node, 1, use reference node forces, no, 1, 2"));
  ASSERT_TRUE(without.ready());
  EXPECT_FALSE(without.model().structural_ports.at(0).use_reference_loads);
}

TEST(ExternalStructuralCard, RefusesWhatItDoesNotServe) {
  EXPECT_EQ(refusal("EDGE, \"flag\", \"data\", 1, 2"),
            "force 5 (external structural): peers that exchange files of EDGE are not supported");
  EXPECT_EQ(refusal("socket, create, yes, 1, 2"),
            "force 5 (external structural): the address of the socket is missing");
  EXPECT_EQ(refusal("socket, port, 70000, 1, 2"),
            "force 5 (external structural): a port is a number from 1 to 65535, got 70000");
  EXPECT_EQ(refusal("socket, port, 7000, socket type, udp, 1, 2"),
            "force 5 (external structural): external forces do not work over UDP");
  EXPECT_EQ(refusal("socket, path, \"p\", sorted, no, 1, 2"),
            "force 5 (external structural): `sorted, no` needs labels");
  EXPECT_EQ(refusal("grpc, port, \"a\", coupling, none, 1, 2"),
            "force 5 (external structural): coupling `none` is not supported");
  EXPECT_EQ(refusal("grpc, port, \"\", 1, 2"),
            "force 5 (external structural): the name of the port is empty");
  EXPECT_EQ(refusal("grpc, \"a\", 1, 2"),
            "force 5 (external structural): `port` expected after `grpc`");
  EXPECT_EQ(refusal("grpc, port, \"a\", 0"),
            "force 5 (external structural): the number of points must be from 1 to 1000000, got 0");
  EXPECT_EQ(refusal("grpc, port, \"a\", coupling, 0, 1, 2"),
            "force 5 (external structural): coupling must be `staggered`, `loose`, `tight` or a "
            "number of "
            "iterations, at least 1");
}

}  // namespace
}  // namespace mbcosim::external_structural_test
