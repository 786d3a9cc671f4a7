/// Hints of `driven` that fit offsets and hinges of a joint to the configuration in which it is
/// switched on.
#include <string>
#include <string_view>
#include <utility>

#include "deck_run.h"
#include "simulation/restored_runs.h"

namespace mbcosim::fitted_joints_test {
namespace {

/// Two free bodies that turn; the joint between them follows `driven`.
std::string deck_with(const std::string& before, const std::string& driven) {
  return R"(begin: data; problem: initial value; end: data;
begin: initial value; initial time: 0.; final time: 1.; time step: 1./64.; method: ms, .6;
  tolerance: 1e-11; max iterations: 30; derivatives tolerance: 1e4; end: initial value;
begin: control data; structural nodes: 2; rigid bodies: 2; joints: 1; max initial iterations: 20; end: control data;
begin: nodes;
  structural: 1, dynamic, .1,.2,.3, euler123, .1,.2,.3, .5,0.,0., 0.,1.,.5;
  structural: 3, dynamic, -.4,.1,.5, euler123, -.5,.3,.1, .5,.2,0., .3,-.4,.5;
end: nodes;
begin: elements;
  body: 1, 1, 2., .1,0.,0., diag, 1.,2.,3.;
  body: 3, 3, 3., .1,.2,-.1, diag, 2.,2.,3.;
  )" + (before.empty() ? "" : before + ";\n") +
         "driven: 5, " + driven + ";\nend: elements;\n";
}
std::string deck(const std::string& driven) { return deck_with("", driven); }

struct FittedJoint {
  std::string hints;  ///< with blanks between them
  std::string joint;  ///< words in capitals stand for the arguments below
  Vec3 x, phi;        ///< of node 1 at t = 1 s: position and rotation vector
};

std::string joint_card(std::string text) {
  const std::pair<const char*, const char*> words[] = {
      {"POINTS_AND_HINGES",
       "1, position, .1,.2,.3, hinge, euler123, .2,-.1,.3, "
       "3, position, -.2,.1,.15, hinge, euler123, -.3,.2,.1"},
      {"POINTS", "1, position, .1,.2,.3, 3, position, -.2,.1,.15"},
      {"HINGES", "1, hinge, euler123, .2,-.1,.3, 3, hinge, euler123, -.3,.2,.1"},
      {"DRIVES", "component, .01,.02, ramp, .1, 0., forever, 0."},
      {"LAW6", "linear viscoelastic generic, diag, 10.,10.,10.,1.,1.,1., proportional, .1"},
      {"ELASTIC6", "linear elastic generic, diag, 10.,10.,10.,1.,1.,1."},
      {"ELASTIC3", "linear elastic generic, diag, 10.,10.,10."},
      {"LAW3", "linear viscoelastic generic, diag, 10.,10.,10., proportional, .1"}};
  for (const auto& [word, arguments] : words)
    if (const auto at = text.find(word); at != std::string::npos)
      text.replace(at, std::string_view(word).size(), arguments);
  return text;
}

std::string driven_card(const std::string& condition, std::string hints, const std::string& joint) {
  for (std::size_t at; (at = hints.find(' ')) != std::string::npos;)
    hints.replace(at, 1, "\",hint,\"");
  return condition + ", hint, \"" + hints + "\", joint: 5, " + joint_card(joint);
}

class FittedJoints : public testing::TestWithParam<FittedJoint> {};

/// Numbers of the reference solver.
TEST_P(FittedJoints, GoOnFromWhereTheyAreSwitchedOn) {
  const FittedJoint& c = GetParam();
  DeckRun run(deck(driven_card("string, \"Time > .5\"", c.hints, c.joint)));
  ASSERT_TRUE(run.ready());
  const StepReport done = run.simulation().run_until(1);
  ASSERT_FALSE(done.error) << done.error->message;
  EXPECT_LT((run.node(1).x - c.x).norm(), 1e-6) << run.node(1).x.transpose();
  EXPECT_LT((run.rotation_vector(1) - c.phi).norm(), 1e-6) << run.rotation_vector(1).transpose();
}

INSTANTIATE_TEST_SUITE_P(
    Joints, FittedJoints,
    testing::Values(
        FittedJoint{"offset{1}", "spherical hinge, POINTS",
                    Vec3(0.557881831123, 0.30223029694, 0.15145509379),
                    Vec3(-0.0327547687482, 1.05833146605, 0.73648814693)},
        FittedJoint{"offset{2}", "spherical hinge, POINTS",
                    Vec3(0.619251292129, 0.294879557626, 0.406224980483),
                    Vec3(0.0108367730218, 1.16136638751, 0.780460413626)},
        FittedJoint{"offset{1} hinge{1}", "revolute hinge, POINTS_AND_HINGES",
                    Vec3(0.600730202282, 0.392348698179, 0.232937191543),
                    Vec3(0.0886388508811, 0.899339337328, 0.806196727586)},
        FittedJoint{"hinge{2} offset{2}", "revolute hinge, POINTS_AND_HINGES",
                    Vec3(0.618278979578, 0.362433679414, 0.274029536652),
                    Vec3(0.0955028301561, 0.858780125177, 0.677869313613)},
        FittedJoint{"offset{2} hinge{2}", "axial rotation, POINTS_AND_HINGES, const, .1",
                    Vec3(0.627283221739, 0.355223295244, 0.264801666677),
                    Vec3(0.103592285239, 0.848008591158, 0.715960269401)},
        FittedJoint{"hinge{1}", "revolute rotation, HINGES",
                    Vec3(0.636468259685, 0.209135552028, 0.258167838262),
                    Vec3(0.0617928915937, 0.952858122466, 0.902517369278)},
        FittedJoint{"hinge{1}", "prismatic, HINGES",
                    Vec3(0.619655616739, 0.213499463952, 0.253904015765),
                    Vec3(0.0951348216057, 0.836386631244, 0.765142154775)},
        FittedJoint{"hinge{2}", "prismatic, HINGES",
                    Vec3(0.619655616739, 0.213499463952, 0.253904015765),
                    Vec3(0.0951348216057, 0.836386631243, 0.765142154775)},
        FittedJoint{"hinge{1}", "drive hinge, HINGES, DRIVES",
                    Vec3(0.614775908305, 0.215061981006, 0.251956912538),
                    Vec3(0.0955507055454, 0.793318827903, 0.731026859065)},
        FittedJoint{"hinge{2}", "drive hinge, HINGES, DRIVES",
                    Vec3(0.616804127672, 0.216923147191, 0.255267479888),
                    Vec3(0.0855397527181, 0.83614299091, 0.717029626872)},
        FittedJoint{"offset{1}", "drive displacement, POINTS, DRIVES",
                    Vec3(0.528893479105, 0.29274187486, 0.151362030166),
                    Vec3(-0.0405548756592, 1.0535946022, 0.750230740706)},
        FittedJoint{"offset{2}", "drive displacement, POINTS, DRIVES",
                    Vec3(0.580662062705, 0.270353122054, 0.40545079995),
                    Vec3(0.00637620512172, 1.13825027317, 0.790724720305)},
        FittedJoint{"offset{1}", "drive displacement pin, 1, position, .1,.2,.3, .2,.1,.4, DRIVES",
                    Vec3(0.281070980792, 0.216904018581, 0.291055561014),
                    Vec3(0.0358850292922, 1.11542110138, 0.729875301818)},
        FittedJoint{"offset{0}", "drive displacement pin, 1, position, .1,.2,.3, .2,.1,.4, DRIVES",
                    Vec3(0.405899362427, 0.134268946925, 0.418900796199),
                    Vec3(0.0158562260072, 1.0829218741, 0.814534094075)},
        FittedJoint{"offset{1} hinge{1}",
                    "revolute pin, 1, position, .1,.2,.3, hinge, euler123, .2,-.1,.3, .2,.1,.4, "
                    "hinge, euler123, -.3,.2,.1",
                    Vec3(0.328297540608, 0.25176237487, 0.289448270301),
                    Vec3(0.110075606075, 0.802345792869, 0.808002677663)},
        FittedJoint{"offset{1}",
                    "total joint, 1, position, .1,.2,.3, position orientation, euler123, "
                    ".2,-.1,.3, 3, position, -.2,.1,.15, position constraint, 1,1,1, DRIVES",
                    Vec3(0.539483395672, 0.300519209667, 0.143432665554),
                    Vec3(-0.0427387588121, 1.04197019231, 0.741644619301)},
        FittedJoint{"offset{2}",
                    "total joint, 1, position, .1,.2,.3, position orientation, euler123, "
                    ".2,-.1,.3, 3, position, -.2,.1,.15, position constraint, 1,1,1, DRIVES",
                    Vec3(0.589664479618, 0.278849316282, 0.399931024272),
                    Vec3(-0.00125568388015, 1.14245551799, 0.790609622025)},
        FittedJoint{"offset{1}",
                    "total pin joint, 1, position, .1,.2,.3, position, .2,.1,.4, position "
                    "orientation, euler123, .2,-.1,.3, position constraint, 1,1,1, DRIVES",
                    Vec3(0.272650814545, 0.209501865646, 0.286013719095),
                    Vec3(0.0390424076701, 1.11129455854, 0.728055394111)},
        FittedJoint{"offset{0}",
                    "total pin joint, 1, position, .1,.2,.3, position, .2,.1,.4, position "
                    "orientation, euler123, .2,-.1,.3, position constraint, 1,1,1, DRIVES",
                    Vec3(0.400742774419, 0.125191977594, 0.416964347859),
                    Vec3(0.0181629119166, 1.08153899629, 0.814564905609)},
        FittedJoint{"offset{1} hinge{2}", "deformable joint, POINTS_AND_HINGES, LAW6",
                    Vec3(0.597449474615, 0.266294953182, 0.200252730892),
                    Vec3(-0.0020814836288, 1.09708039751, 0.750239657851)},
        FittedJoint{"offset{2} hinge{1}", "deformable joint, POINTS_AND_HINGES, LAW6",
                    Vec3(0.622517635207, 0.259700596073, 0.335934298306),
                    Vec3(0.016584868015, 1.15047233628, 0.779428090689)},
        FittedJoint{"offset{2}", "deformable displacement joint, POINTS_AND_HINGES, LAW3",
                    Vec3(0.622805500602, 0.259799317974, 0.338665240627),
                    Vec3(0.0151105491865, 1.17142821781, 0.777240793186)},
        FittedJoint{"hinge{1}", "deformable hinge, HINGES, LAW3",
                    Vec3(0.633418343513, 0.217791120028, 0.264880527433),
                    Vec3(0.0398509739471, 1.01337862591, 0.782953558741)},
        FittedJoint{"hinge{2}", "deformable hinge, HINGES, LAW3",
                    Vec3(0.633418343513, 0.217791120028, 0.264880527433),
                    Vec3(0.0398509739471, 1.01337862591, 0.782953558741)},
        FittedJoint{"hinge{1}", "invariant deformable hinge, HINGES, LAW3",
                    Vec3(0.633418343513, 0.217791120028, 0.264880527433),
                    Vec3(0.0398509739471, 1.01337862591, 0.782953558741)},
        FittedJoint{"hinge{2}", "invariant deformable hinge, HINGES, LAW3",
                    Vec3(0.633418343513, 0.217791120028, 0.264880527433),
                    Vec3(0.0398509739471, 1.01337862591, 0.782953558741)},
        FittedJoint{"offset{1} hinge{2}",
                    "invariant deformable displacement joint, POINTS_AND_HINGES, ELASTIC3",
                    Vec3(0.606663143078, 0.252809387982, 0.217980448099),
                    Vec3(0.0028633911835, 1.1338552182, 0.753745715724)},
        FittedJoint{"offset{2} hinge{1}",
                    "invariant deformable displacement joint, POINTS_AND_HINGES, ELASTIC3",
                    Vec3(0.62945611184, 0.250057056951, 0.320549715677),
                    Vec3(0.0191976334901, 1.17698404475, 0.773358243822)},
        FittedJoint{"hinge{1}", "deformable axial joint, HINGES, linear elastic, 3.",
                    Vec3(0.644539067232, 0.223640125502, 0.272447365993),
                    Vec3(0.0353031257505, 1.17808310295, 0.747008315002)}));

/// In the reference solver it jumps away.
TEST(FittedJoint, PinIsWhereThePointIs) {
  const Vec3 point(.1, .2, .3);
  const auto place = [&](const DeckRun& run) {
    return Vec3(run.node(1).x + run.node(1).R * point);
  };
  DeckRun free(deck("const, 0., joint: 5, clamp, 1, node, node")),
      pinned(deck(driven_card("string, \"Time > .5\"", "offset{0} hinge{1}",
                              "revolute pin, 1, position, .1,.2,.3, hinge, euler123, .2,-.1,.3, "
                              ".2,.1,.4, hinge, euler123, -.3,.2,.1")));
  ASSERT_TRUE(free.ready() && pinned.ready());
  free.step(33);
  pinned.step(33);
  const Vec3 pin = place(pinned);
  EXPECT_LT((pin - place(free)).norm(), 1e-4);  // where the first step with the pin is predicted
  pinned.step(31);
  EXPECT_LT((place(pinned) - pin).norm(), 1e-6);
}

/// An isotropic law has no axes. (In the reference solver `hinge{1}` changes its forces.)
TEST(FittedJoint, HingeOfAnIsotropicDisplacementDoesNotMatter) {
  const std::string joint = "deformable displacement joint, POINTS_AND_HINGES, LAW3",
                    later = "string, \"Time > .5\"";
  DeckRun fitted(deck(driven_card(later, "hinge{1}", joint))),
      plain(deck(later + ", joint: 5, " + joint_card(joint)));
  ASSERT_TRUE(fitted.ready() && plain.ready());
  fitted.step(64);
  plain.step(64);
  EXPECT_LT((fitted.node(1).x - plain.node(1).x).norm(), 1e-9);
  EXPECT_LT((fitted.rotation_vector(1) - plain.rotation_vector(1)).norm(), 1e-9);
}

/// In the reference solver, too, the displacement joint and the hinge together give these numbers,
/// but the joint that is both moves otherwise, with and without hints.
TEST(FittedJoint, InvariantJointIsADisplacementJointAndAHinge) {
  const std::string later = "string, \"Time > .5\"";
  std::string both = deck(later + ", joint: 5, " +
                          joint_card("invariant deformable displacement joint, "
                                     "POINTS_AND_HINGES, ELASTIC3") +
                          "; driven: 6, " + later + ", joint: 6, " +
                          joint_card("invariant deformable hinge, HINGES, linear elastic, 1."));
  both.replace(both.find("joints: 1"), 9, "joints: 2");
  DeckRun apart(both), joint(deck(later + ", joint: 5, " +
                                  joint_card("invariant deformable joint, POINTS_AND_HINGES, "
                                             "ELASTIC6")));
  ASSERT_TRUE(apart.ready() && joint.ready());
  apart.step(64);
  joint.step(64);
  const Vec3 x(0.182382190029, 0.130999292141, 0.335918929445),
      phi(-0.193311251031, 0.95197775749, 0.891769258262);
  for (const DeckRun* run : {&apart, &joint}) {
    EXPECT_LT((run->node(1).x - x).norm(), 1e-6) << run->node(1).x.transpose();
    EXPECT_LT((run->rotation_vector(1) - phi).norm(), 1e-6);
  }
}

/// From a snapshot in which the joint is off, and from one in which it is on.
TEST(FittedJoint, ContinuesFromSnapshots) {
  for (const char* joint : {"revolute hinge, POINTS_AND_HINGES", "prismatic, HINGES"}) {
    const bool points = joint[0] == 'r';
    const std::string text = deck(
        driven_card("string, \"Time > .5\"", points ? "offset{2} hinge{1}" : "hinge{1}", joint));
    expect_restored_runs_continue(text, 20, 20);
    expect_restored_runs_continue(text, 40, 10);
  }
}

TEST(FittedJoint, MayHaveACardOfItsOwn) {
  const std::string later = "string, \"Time > .5\"", hints = "hint, \"offset{2}\"",
                    joint = "joint: 5, " + joint_card("spherical hinge, POINTS");
  DeckRun inside(deck(later + ", " + hints + ", " + joint)),
      outside(deck_with(joint, later + ", " + hints + ", existing: joint, 5"));
  ASSERT_TRUE(inside.ready() && outside.ready());
  inside.step(64);
  outside.step(64);
  EXPECT_LT((inside.node(1).x - Vec3(.619251292129, .294879557626, .406224980483)).norm(), 1e-6);
  EXPECT_EQ(inside.node(1).x, outside.node(1).x);
}

/// A joint that is on from the beginning stands as its card says: the initial assembly closes the
/// gap of 1 cm. (So it does in the reference solver.) Blanks in a hint do not matter.
TEST(FittedJoint, IsNotFittedAtTheStart) {
  const std::string joint =
      "joint: 5, spherical hinge, 1, position, null, 3, position, reference, other node, .01,0.,0.";
  DeckRun hinted(deck("const, 1., hint, \"offset { 1 }\", " + joint)),
      plain(deck("const, 1., " + joint));
  ASSERT_TRUE(hinted.ready() && plain.ready());
  EXPECT_GT((plain.node(1).x - Vec3(.1, .2, .3)).norm(), 1e-3);
  EXPECT_LT((hinted.node(1).x - plain.node(1).x).norm(), 1e-9);
  hinted.step(5);
  plain.step(5);
  EXPECT_LT((hinted.node(1).x - plain.node(1).x).norm(), 1e-9);
}

}  // namespace
}  // namespace mbcosim::fitted_joints_test
