/// Free rigid bodies built without a deck: closed forms, energy, order of convergence, restart.
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>

#include "elements/bodies/body.h"
#include "simulation/simulation.h"

namespace mbcosim::rigid_body_test {
namespace {

struct BodyCase {
  double h = 1e-3, final_time = 1, tolerance = 1e-10;
  Method method = Method::multistep;
  double rho = 0.6;
  bool gravity = false;
  Vec3 inertia = Vec3(1, 1, 1);
  Vec3 v = Vec3(0, 1, 0), w = Vec3::Zero();
  Vec3 offset = Vec3::Zero();
};

ModelPtr make_model(const BodyCase& s) {
  ModelBuilder builder;
  Model& model = builder.model();
  model.initial_value.time_step = s.h;
  model.initial_value.final_time = s.final_time;
  model.initial_value.tolerance = s.tolerance;
  model.initial_value.max_iterations = 20;
  model.initial_value.method = {s.method, make_constant_drive(s.rho), nullptr};
  if (s.gravity) {
    Gravity g;
    g.uniform = make_constant_vec3_drive(Vec3(0, 0, -9.81));
    model.gravity = g;
  }
  StructuralNode node;
  node.label = 1;
  node.kind = StructuralKind::dynamic;
  node.v = s.v;
  node.w = s.w;
  Body body;
  body.node = builder.add_structural(node);
  body.m = 2;
  body.S0 = 2 * s.offset;
  const Mat3 dx = cross<double>(s.offset);
  body.J0 = Mat3(s.inertia.asDiagonal()) - 2 * dx * dx;
  ElementInfo info;
  info.family = Family::body;
  info.label = 1;
  add_element(builder, info, body);
  auto built = builder.finish();
  return *built;
}

std::unique_ptr<Simulation> start(const BodyCase& s) {
  auto simulation = Simulation::create(make_model(s));
  EXPECT_TRUE(simulation) << simulation.error().message;
  return std::move(*simulation);
}

double kinetic_energy(const Simulation& s) {
  const NodeRotation& q = s.state().rotation[0];
  const std::vector<double>&y = s.state().y, &yp = s.state().yp;
  return 0.5 * (Vec3(yp[0], yp[1], yp[2]).dot(Vec3(y[6], y[7], y[8])) +
                q.w.dot(Vec3(y[9], y[10], y[11])));
}

TEST(FreeBody, FallsAsInTheTextbook) {
  BodyCase s;
  s.gravity = true;
  auto simulation = start(s);
  const StepReport report = simulation->run_until(1);
  EXPECT_EQ(report.outcome, StepOutcome::finished);
  EXPECT_EQ(report.steps_done, 1000);
  EXPECT_NEAR(simulation->time(), 1, 1e-12);
  const std::vector<double>&y = simulation->state().y, &yp = simulation->state().yp;
  EXPECT_NEAR(y[0], 0, 1e-14);
  EXPECT_NEAR(y[1], 1, 1e-9);
  EXPECT_NEAR(y[2], -0.5 * 9.81, 1e-7);
  EXPECT_NEAR(yp[2], -9.81, 1e-8);
}

TEST(FreeBody, TumblingKeepsMomentumAndNearlyKeepsEnergy) {
  BodyCase s;
  s.inertia = Vec3(1, 2, 3);
  s.w = Vec3(0.01, 4, 0.01);
  s.method = Method::multistep;
  s.rho = 1;
  auto simulation = start(s);
  const double energy = kinetic_energy(*simulation);
  const Vec3 momentum(simulation->state().y[9], simulation->state().y[10],
                      simulation->state().y[11]);
  simulation->run_until(1);
  const std::vector<double>& y = simulation->state().y;
  EXPECT_NEAR((Vec3(y[9], y[10], y[11]) - momentum).norm(), 0, 1e-8);
  EXPECT_NEAR(kinetic_energy(*simulation) / energy, 1, 1e-5);
}

/// Angle between the orientation after 0.64 s with step h and that with a step 32 times shorter
/// than the finest one used.
double orientation_error(Method method, double rho, double h) {
  BodyCase s;
  s.inertia = Vec3(1, 2, 3);
  s.w = Vec3(1, 2, 3);
  s.method = method;
  s.rho = rho;
  s.tolerance = 1e-9;
  const auto orientation = [&](double step, Method m) {
    s.h = step;
    s.method = m;
    auto simulation = start(s);
    simulation->run_until(0.64);
    return simulation->state().rotation[0].R;
  };
  static const Mat3 reference = orientation(0.01 / 64, Method::crank_nicolson);
  return vector_of_rotation<double>(orientation(h, method) * reference.transpose()).norm();
}

TEST(Multistep, IsSecondOrderOnTheTumblingBody) {
  EXPECT_NEAR(std::log2(orientation_error(Method::multistep, 0.6, 0.02) /
                        orientation_error(Method::multistep, 0.6, 0.01)),
              2.0, 0.15);
  EXPECT_NEAR(std::log2(orientation_error(Method::crank_nicolson, 0, 0.02) /
                        orientation_error(Method::crank_nicolson, 0, 0.01)),
              2.0, 0.15);
  EXPECT_NEAR(std::log2(orientation_error(Method::hope, 0.6, 0.02) /
                        orientation_error(Method::hope, 0.6, 0.01)),
              2.0, 0.2);
}

TEST(ImplicitEuler, IsFirstOrderOnTheTumblingBody) {
  EXPECT_NEAR(std::log2(orientation_error(Method::bdf1, 0, 0.01) /
                        orientation_error(Method::bdf1, 0, 0.005)),
              1.0, 0.1);
}

TEST(FreeBody, ReferenceSolverNumbers) {
  // Offset mass, nutation, ms .6; figures of the reference solver.
  BodyCase s;
  s.h = 1e-2;
  s.tolerance = 1e-11;
  ModelBuilder builder;
  Model& model = builder.model();
  model.initial_value.time_step = 1e-2;
  model.initial_value.final_time = 1;
  model.initial_value.tolerance = 1e-11;
  model.initial_value.max_iterations = 20;
  model.initial_value.method = {Method::multistep, make_constant_drive(.6), nullptr};
  StructuralNode node;
  node.label = 1;
  node.kind = StructuralKind::dynamic;
  node.x = Vec3(.1, .2, .3);
  node.R = rotation_of_euler123(Vec3(.1, .2, .3));
  node.v = Vec3(.5, -.25, 1.);
  node.w = Vec3(1., 6., .5);
  Body body;
  body.node = builder.add_structural(node);
  body.m = 2;
  const Vec3 x(.05, -.02, .1);
  body.S0 = 2 * x;
  body.J0 = Mat3(Vec3(.3, .5, .7).asDiagonal()) - 2 * cross<double>(x) * cross<double>(x);
  ElementInfo info;
  info.family = Family::body;
  info.label = 1;
  add_element(builder, info, body);
  auto simulation = Simulation::create(*builder.finish());
  ASSERT_TRUE(simulation) << simulation.error().message;
  const auto expect_node = [&](const Vec3& position, const Vec3& angles, const Vec3& velocity,
                               const Vec3& omega) {
    const State& state = (*simulation)->state();
    EXPECT_NEAR((Vec3(state.y[0], state.y[1], state.y[2]) - position).norm(), 0, 1e-9);
    EXPECT_NEAR((euler123_of_rotation(state.rotation[0].R) * kDegrees - angles).norm(), 0, 2e-7);
    EXPECT_NEAR((Vec3(state.yp[0], state.yp[1], state.yp[2]) - velocity).norm(), 0, 1e-9);
    EXPECT_NEAR((state.rotation[0].w - omega).norm(), 0, 1e-9);
  };
  (*simulation)->step();
  expect_node(
      {0.10513859743, 0.19747445815, 0.31015701032}, {6.3196465352, 14.908735266, 17.098775302},
      {0.52771948602, -0.25510837044, 1.0314020646}, {0.98715963765, 6.0050813127, 0.45954425733});
  (*simulation)->step_many(9);
  expect_node(
      {0.16630455886, 0.17286187233, 0.41292400321}, {13.651777137, 45.768122427, 12.524259942},
      {0.84988876518, -0.28758634533, 1.2231488691}, {0.83392862964, 6.0496472354, 0.10401702173});
  (*simulation)->step_many(90);
  expect_node(
      {1.1002589819, -0.071913114799, 0.89778255475}, {80.993266795, 41.430311456, 60.700704230},
      {0.68542143784, -0.48700643128, 1.1759561044}, {1.5326022967, 5.7425013870, 2.5544012014});
}

TEST(Simulation, ContinuesARestoredStateBitForBit) {
  BodyCase s;
  s.inertia = Vec3(1, 2, 3);
  s.w = Vec3(1, 2, 3);
  auto straight = start(s), other = start(s);
  straight->step_many(50);
  const std::string bytes = straight->export_state();
  straight->step_many(50);
  ASSERT_TRUE(other->import_state(bytes));
  auto fork = other->fork();
  other->step_many(50);
  fork->step_many(50);
  EXPECT_EQ(straight->state().y, other->state().y);
  EXPECT_EQ(straight->state().yp, fork->state().yp);
  std::string damaged = bytes;
  damaged[damaged.size() / 2] ^= 1;
  EXPECT_EQ(other->import_state(damaged).error().kind, ErrorKind::data_loss);
}

TEST(Simulation, NamesTheUnknownThatNothingDetermines) {
  ModelBuilder builder;
  StructuralNode node;
  node.label = 4;
  node.kind = StructuralKind::static_;
  builder.add_structural(node);
  builder.model().initial_value.final_time = 1;
  auto simulation = Simulation::create(*builder.finish());
  ASSERT_TRUE(simulation);
  const std::vector<double> load = {1, 0, 0, 0, 0, 0};
  ASSERT_TRUE((*simulation)->set((*simulation)->find_variable("node.structural.4.load"), load));
  const StepReport report = (*simulation)->step();
  ASSERT_TRUE(report.error);
  EXPECT_EQ(report.error->kind, ErrorKind::singular);
  EXPECT_NE(report.error->message.find("structural node 4"), std::string::npos)
      << report.error->message;
  EXPECT_EQ((*simulation)->step_number(), 0);
}

TEST(Simulation, StopsBetweenIterationsWhenCancelled) {
  auto simulation = start(BodyCase{.w = Vec3(1, 2, 3)});
  simulation->step_many(3);
  CancelToken cancel;
  cancel.cancel();
  const std::vector<double> before = simulation->state().y;
  const StepReport report = simulation->step(&cancel);
  EXPECT_EQ(report.outcome, StepOutcome::interrupted);
  EXPECT_EQ(simulation->state().y, before);
  EXPECT_EQ(simulation->step_number(), 3);
}

// Each step converges at once; without a look at the token it would go on for ever.
TEST(Simulation, StopsBetweenStepsWhenCancelled) {
  auto simulation = start(BodyCase{.final_time = 1e9});
  CancelToken cancel;
  cancel.set_deadline(std::chrono::steady_clock::now() + std::chrono::milliseconds(50));
  const StepReport report = simulation->step_many(std::int64_t{1} << 60, &cancel);
  EXPECT_EQ(report.outcome, StepOutcome::interrupted);
}

}  // namespace
}  // namespace mbcosim::rigid_body_test
