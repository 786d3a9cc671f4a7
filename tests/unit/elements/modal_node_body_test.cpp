#include "elements/bodies/modal_node_body.h"

#include <gtest/gtest.h>

#include "elements/conformance.h"
#include "elements/modal_deck.h"

namespace mbcosim::modal_node_body_test {
namespace {

using decks::hand_made;
using decks::ModalDeck;
using decks::ModalRun;

Body generic_body(int node) {
  Body body;
  body.node = node;
  body.m = 2.5;
  body.S0 = Vec3(.3, -.2, .5);
  body.J0 << 3, .1, .2, .1, 4, .3, .2, .3, 5;
  return body;
}

TEST(ModalNodeBody, JacobianMatchesCentralDifferences) {
  for (const bool central : {false, true}) {
    conformance::Bench bench;
    const int node = bench.add_node(StructuralKind::modal);
    Gravity g;
    if (central)
      g.mass_g = 7;
    else
      g.uniform = make_constant_vec3_drive(Vec3(1, -2, 9.81));
    bench.builder.model().gravity = g;
    ElementInfo info;
    info.label = 1;
    add_general_element(bench.builder, info, std::make_unique<ModalNodeBody>(generic_body(node)));
    bench.finish();
    for (int k = 0; k < 3; ++k) {
      bench.generic_state(0.3);
      const MatX J = bench.jacobian();
      EXPECT_GT(J.norm(), 1e-3);
      conformance::expect_near(bench, J, bench.numerical_jacobian(), 1e-7);
    }
  }
}

/// A modal body that does not deform and a body on its node, beside the same two bodies on a
/// dynamic node: one integrates velocities, the other momenta, so that they differ by O(h²).
double difference_from_rigid_bodies(double h) {
  ModalDeck deck;
  deck.h = h;
  deck.final_time = 1;
  deck.initial_value = "method: ms, .6; derivatives coefficient: 1.e-6;";
  deck.control = "structural nodes: 2; joints: 1; rigid bodies: 3; forces: 4;";
  deck.files = {{"rigid.fem", write_fem_text(hand_made(false), {})}};
  deck.node(1, "modal", {Vec3(1, 2, 3), rotation_of_vector<double>(Vec3(.3, .2, .1))});
  deck.node(2, "dynamic", {Vec3(1, 2, 3), rotation_of_vector<double>(Vec3(.3, .2, .1))});
  deck.joints = "joint: 1, modal, 1, 2, from file, no damping, \"rigid.fem\", 0;\n";
  deck.others = "body: 20, 2, 3., null, diag, 11., 3., 11.;\n";
  for (const char* node : {"1", "2"}) {
    deck.others +=
        std::string("body: ") + node + ", " + node + ", 2., .1, -.2, .3, diag, 1., 2., 2.5;\n";
    deck.forces += std::string("force: ") + node + ", follower, " + node +
                   ", position, .5, 1., 0., 1., 2., 3., const, 4.;\n" + "couple: 1" + node +
                   ", follower, " + node + ", 1., -1., 2., const, 3.;\n";
  }
  ModalRun run(deck);
  run.to(1);
  const NodeState modal = run.node(1), dynamic = run.node(2);
  EXPECT_GT((dynamic.x - Vec3(1, 2, 3)).norm(), 1);
  EXPECT_GT(dynamic.w.norm(), .5);
  return (modal.x - dynamic.x).norm() + (modal.R - dynamic.R).norm() + (modal.w - dynamic.w).norm();
}

TEST(ModalNodeBody, MovesAsRigidBodiesDo) {
  const double coarse = difference_from_rigid_bodies(1e-2),
               fine = difference_from_rigid_bodies(5e-3);
  EXPECT_LT(fine, 1e-3);
  EXPECT_NEAR(coarse / fine, 4, .5);
}

/// Free flight goes on as it began; MBDyn's first step adds the body's momentum once more.
TEST(ModalNodeBody, KeepsTheVelocityOfTheStart) {
  ModalDeck deck;
  deck.initial_value = "derivatives coefficient: 1.e-6;";
  deck.control = "structural nodes: 1; joints: 1; rigid bodies: 1;";
  deck.files = {{"rigid.fem", write_fem_text(hand_made(false), {})}};
  const Vec3 v(.1, .2, .3);
  deck.node(1, "modal", {Vec3::Zero(), Mat3::Identity(), v});
  deck.joints = "joint: 1, modal, 1, 2, from file, no damping, \"rigid.fem\", 0;\n";
  deck.others = "body: 1, 1, 2., .1, -.2, .3, diag, 1., 2., 2.5;\n";
  ModalRun run(deck);
  run.to(1);
  EXPECT_LT((run.node(1).v - v).norm(), 1e-9);
  EXPECT_LT((run.node(1).x - v).norm(), 1e-9);
}

}  // namespace
}  // namespace mbcosim::modal_node_body_test
