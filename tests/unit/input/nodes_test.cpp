#include <gtest/gtest.h>

#include "deck_fixture.h"
#include "elements/modal_bodies.h"

namespace mbcosim::decks::nodes_test {
namespace {

ModelPtr nodes(const std::string& cards, const std::string& control = "",
               const std::string& elements = "") {
  DeckText d;
  d.nodes = cards;
  d.control = control;
  d.elements = elements;
  const LoadReport report = load(d.text(), {{"body.fem", write_fem_text(hand_made(true), {})}});
  EXPECT_TRUE(report.ok()) << findings(report.diagnostics);
  return report.model;
}

void expect_near(const Vec3& value, double a, double b, double c) {
  EXPECT_LT((value - Vec3(a, b, c)).norm(), 1e-6) << value.transpose();
}

TEST(StructuralNode, ReadsEveryKind) {
  const ModelPtr model = nodes(
      "structural: 1, name, \"tip\", dynamic, position, 1.,2.,3., orientation, euler, .1,.2,.3, "
      "orientation description, euler321,"
      "  velocity, 4.,5.,6., angular velocity, 7.,8.,9., assembly, 2., 3., yes, scale, 5., output, "
      "no, accelerations, yes,"
      "  output inertia, no;"
      "structural: 2, static, null, eye, null, null;"
      "structural: 3, modal, null, eye, null, null;"
      "structural: 4, static displacement, 1.,0.,0., null;"
      "structural: 5, dynamic displacement, 1.,0.,0., null, assembly, 2., 3., accelerations, no;",
      "", "joint: 1, modal, 3, 2, from file, no damping, \"body.fem\", 0;");
  ASSERT_TRUE(model);
  ASSERT_EQ(model->structural.size(), 5u);
  const StructuralNode& n = model->structural[0];
  EXPECT_EQ(n.name, "tip");
  EXPECT_EQ(n.kind, StructuralKind::dynamic);
  EXPECT_EQ(n.x, Vec3(1, 2, 3));
  EXPECT_EQ(n.v, Vec3(4, 5, 6));
  EXPECT_EQ(n.w, Vec3(7, 8, 9));
  EXPECT_EQ(n.description, OrientationDescription::euler321);
  EXPECT_EQ(n.assembly_position_stiffness, 2);
  EXPECT_EQ(n.assembly_velocity_stiffness, 3);
  EXPECT_TRUE(n.omega_rotates);
  EXPECT_EQ(n.scale, 5);
  EXPECT_FALSE(n.output);
  EXPECT_TRUE(n.accelerations);
  EXPECT_FALSE(n.output_inertia);
  EXPECT_EQ(model->structural[1].kind, StructuralKind::static_);
  EXPECT_EQ(model->structural[2].kind, StructuralKind::modal);
  EXPECT_EQ(model->structural[3].kind, StructuralKind::static_displacement);
  EXPECT_EQ(model->structural[4].kind, StructuralKind::dynamic_displacement);
  EXPECT_EQ(model->structural[4].assembly_velocity_stiffness, 3);
}

TEST(StructuralNode, TakesDefaultsFromControlData) {
  const ModelPtr model = nodes(
      "structural: 1, dynamic, null, eye, null, null; structural: 2, dynamic, null, eye, null, "
      "null, "
      "output, no;",
      "initial stiffness: 4.; omega rotates: yes; default output: none, structural nodes, "
      "accelerations;"
      "default orientation: orientation matrix; default scale: structural nodes, 3.;");
  ASSERT_TRUE(model);
  const StructuralNode& n = model->structural[0];
  EXPECT_EQ(n.assembly_position_stiffness, 4);
  EXPECT_EQ(n.assembly_velocity_stiffness, 4);
  EXPECT_TRUE(n.omega_rotates);
  EXPECT_TRUE(n.output);
  EXPECT_TRUE(n.accelerations);
  EXPECT_EQ(n.description, OrientationDescription::matrix);
  EXPECT_EQ(n.scale, 3);
  EXPECT_FALSE(model->structural[1].output);
}

TEST(StructuralNode, IsStaticInAStaticModel) {
  const ModelPtr model = nodes(
      "structural: 1, dynamic, null, eye, null, null; structural: 2, dynamic displacement, null, "
      "null;",
      "model: static;");
  ASSERT_TRUE(model);
  EXPECT_EQ(model->structural[0].kind, StructuralKind::static_);
  EXPECT_EQ(model->structural[1].kind, StructuralKind::static_displacement);
}

TEST(DummyNode, FollowsItsBase) {
  const ModelPtr model = nodes(
      "structural: 1, static, 1.,2.,3., euler, .1,.2,.3, null, 0.,0.,1.;"
      "structural: 2, static, 4.,5.,6., euler, .3,.2,.1, null, null;"
      "structural: 3, dummy, 1, offset, 1.,0.,0., eye;"
      "structural: 4, dummy, 1, relative frame, 2;"
      "structural: 5, dummy, 1, relative frame, 2, position, 1.,0.,0., orientation, euler, "
      ".1,0.,0.;"
      "structural: 6, dummy, 1, relative frame, 2, pivot node, 2;");
  ASSERT_TRUE(model);
  expect_near(model->structural[2].x, 1.936293, 2.312992, 2.840655);
  expect_near(model->structural[2].v, -.312992, .936293, 0);
  expect_near(model->structural[3].x, -2.908852, -3.479553, -2.536000);
  expect_near(model->structural[4].x, -3.908852, -3.715347, -2.175955);
  expect_near(model->structural[5].x, 1, 2, 3);
}

// What the reference solver writes for each of them.
TEST(DummyNode, HasAccelerationsWhereAllItsNodesDo) {
  const ModelPtr model = nodes(
      "structural: 1, dynamic, null, eye, null, null, accelerations, yes;"
      "structural: 2, dynamic, null, eye, null, null, accelerations, yes;"
      "structural: 3, static, null, eye, null, null;"
      "structural: 4, dummy, 1, offset, null, eye;"
      "structural: 5, dummy, 1, relative frame, 2;"
      "structural: 6, dummy, 1, relative frame, 3;"
      "structural: 7, dummy, 3, relative frame, 1;"
      "structural: 8, dummy, 1, relative frame, 2, pivot node, 3;");
  ASSERT_TRUE(model);
  const bool expected[] = {true, true, false, false, false};
  for (int k = 0; k < 5; ++k) EXPECT_EQ(model->structural[3 + k].accelerations, expected[k]) << k;
}

TEST(ScalarNode, ReadsValuesWithAndWithoutKeyword) {
  const ModelPtr model = nodes(
      "abstract: 1; abstract: 2, algebraic, value, 3.; abstract: 3, differential, 4., derivative, "
      "5., scale, 6., output, no;"
      "abstract: 4, output, no; electric: 1, value, 7., derivative, 8.; hydraulic: 1, 1e5; "
      "thermal: 1, name, \"wall\", value, 300.;"
      "parameter: 1, 9.; parameter: 2, value, 10., output, no;",
      "", "genel: 1, clamp, 1, hydraulic, const, 1e5;");
  ASSERT_TRUE(model);
  ASSERT_EQ(model->scalars.size(), 9u);
  EXPECT_TRUE(model->scalars[0].differential);
  EXPECT_FALSE(model->scalars[1].differential);
  EXPECT_EQ(model->scalars[1].value, 3);
  EXPECT_EQ(model->scalars[2].value, 4);
  EXPECT_EQ(model->scalars[2].rate, 5);
  EXPECT_EQ(model->scalars[2].scale, 6);
  EXPECT_FALSE(model->scalars[2].output);
  EXPECT_FALSE(model->scalars[3].output);
  EXPECT_EQ(model->scalars[4].rate, 8);
  EXPECT_FALSE(model->scalars[5].differential);
  EXPECT_EQ(model->scalars[5].value, 1e5);
  EXPECT_EQ(model->scalars[6].name, "wall");
  EXPECT_EQ(model->scalars[7].value, 9);
  EXPECT_EQ(model->initial_memory.at(model->scalars[8].memory), 10);
}

/// 0 until a period is over, then the dof of the step that samples. (As the reference solver.)
TEST(ParameterNode, SamplesAndHolds) {
  const ModelPtr model =
      nodes("abstract: 1, value, 2.; parameter: 3, sample and hold, 1, abstract, .25;");
  ASSERT_TRUE(model);
  ASSERT_EQ(model->step_listeners.size(), 1u);
  State state = make_initial_state(*model);
  std::vector<double> held;
  for (int k = 0; k <= 6; ++k) {
    state.time = .1 * k;
    EvalContext context = model->context(state, Phase::step);
    model->step_listeners[0]->advance(context, state, k == 0);
    state.y[model->scalars[0].unknown] = 10 + k;
    held.push_back(model->dof_value(context, {false, 1, 0, 0, false}));
  }
  EXPECT_EQ(held, (std::vector<double>{0, 0, 0, 13, 13, 15, 15}));
}

TEST(OutputCard, SwitchesNodesOn) {
  DeckText d;
  d.control = "default output: none;";
  d.nodes =
      "structural: 1, dynamic, null, eye, null, null; structural: 2, dynamic, null, eye, null, "
      "null;"
      "structural: 7, dynamic, null, eye, null, null; structural: 8, dynamic displacement, null, "
      "null; abstract: 3; output: structural, accelerations, 1, range, 5, 8;"
      "output: abstract, 4;";
  const LoadReport report = load(d);
  ASSERT_TRUE(report.ok());
  EXPECT_EQ(findings(report.diagnostics), "warning: abstract node 4 is not defined");
  EXPECT_TRUE(report.model->structural[0].output);
  EXPECT_TRUE(report.model->structural[0].accelerations);
  EXPECT_FALSE(report.model->structural[1].output);
  EXPECT_TRUE(report.model->structural[2].output);
  EXPECT_FALSE(report.model->structural[2].output_inertia);
  EXPECT_TRUE(report.model->structural[3].output_inertia);
  EXPECT_FALSE(report.model->scalars[0].output);
}

TEST(PrivateData, OfStructuralNodesMatchTheReferenceSolver) {
  const ModelPtr model = nodes(
      "structural: 1, static, .5,.6,.7, euler, .2,.1,-.3, .1,.2,.3, .4,.5,.6;"
      "structural: 2, static, -.5,.3,.2, euler, -.4,.5,.6, .3,.1,-.2, -.1,.7,.2;");
  ASSERT_TRUE(model);
  const State state = make_initial_state(*model);
  const EvalContext context = model->context(state, Phase::step);
  const auto datum = [&](const char* name) {
    const int k = model->structural_datum(0, name);
    EXPECT_GE(k, 0) << name;
    return model->structural_datum_value(context, 0, k);
  };
  const std::pair<const char*, double> expected[] = {{"x[1]", .2063440829},
                                                     {"x[2]", .8249316688},
                                                     {"x[3]", .6139298504},
                                                     {"xP[1]", -.004735169235},
                                                     {"xP[2]", .2660997246},
                                                     {"xP[3]", .2629990775},
                                                     {"omega[1]", .1535742699},
                                                     {"omega[2]", .6852236828},
                                                     {"omega[3]", .5261971572},
                                                     {"E[1]", .2},
                                                     {"E[2]", .1},
                                                     {"E[3]", -.3}};
  for (const auto& e : expected) EXPECT_NEAR(datum(e.first), e.second, 1e-9) << e.first;
  const std::pair<const char*, double> rounded[] = {
      {"E313[1]", .467666}, {"E313[2]", .223307}, {"E313[3]", -.757625}, {"E321[1]", -.277416},
      {"E321[2]", .152778}, {"E321[3]", .163505}, {"PE[0]", .983347},    {"PE[1]", .0911575},
      {"PE[2]", .0640713},  {"PE[3]", -.143572}};
  for (const auto& e : rounded) EXPECT_NEAR(datum(e.first), e.second, 1e-6) << e.first;
  EXPECT_EQ(model->structural_datum(0, "XPP[1]"), -1);
}

TEST(PrivateData, OfStructuralNodesAreCountedAsInTheManual) {
  const ModelPtr model = nodes(
      "structural: 1, static, null, eye, null, null;"
      "structural: 2, dynamic, null, eye, null, null;",
      "", "body: 2, 2, 1., null, eye;");
  ASSERT_TRUE(model);
  const auto names = [&](int node) {
    return Model::structural_data_names(model->structural[node]);
  };
  EXPECT_EQ(names(0).size(), 34u);
  ASSERT_EQ(names(1).size(), 46u);
  const std::pair<int, const char*> expected[] = {
      {1, "X[1]"},     {4, "x[1]"},       {7, "Phi[1]"},     {10, "XP[1]"},
      {13, "xP[1]"},   {16, "Omega[1]"},  {19, "omega[1]"},  {22, "E[1]"},
      {25, "E313[1]"}, {28, "E321[1]"},   {31, "PE[0]"},     {35, "XPP[1]"},
      {38, "xPP[1]"},  {41, "OmegaP[1]"}, {44, "omegaP[1]"}, {46, "omegaP[3]"}};
  for (const auto& [index, name] : expected) EXPECT_EQ(names(1)[index - 1], name) << index;
}

// Numbers of the reference solver: -cos 1 and sin 1.
TEST(PrivateData, TheLargestEulerParameterIsPositive) {
  const ModelPtr model = nodes("structural: 1, static, null, vector, 0.,0.,-2., null, null;");
  ASSERT_TRUE(model);
  const State state = make_initial_state(*model);
  const EvalContext context = model->context(state, Phase::step);
  const double expected[] = {-.54030230586814, 0, 0, .841470984807897};
  for (int i = 0; i < 4; ++i) {
    const int k = model->structural_datum(0, "PE[" + std::to_string(i) + "]");
    EXPECT_NEAR(model->structural_datum_value(context, 0, k), expected[i], 1e-14) << i;
  }
}

}  // namespace
}  // namespace mbcosim::decks::nodes_test
