#include <gtest/gtest.h>

#include "deck_fixture.h"

namespace mbcosim::decks::frames_test {
namespace {

Mat3 rows(std::initializer_list<double> v) {
  Mat3 m;
  int i = 0;
  for (const double x : v) m(i / 3, i % 3) = x, ++i;
  return m;
}

struct RotationCase {
  const char* text;
  Mat3 expected;
};

class OrientationForm : public testing::TestWithParam<RotationCase> {};

TEST_P(OrientationForm, GivesTheMatrixOfTheReference) {
  const ModelPtr model = model_of("reference: 1, null, " + std::string(GetParam().text) + ";");
  ASSERT_TRUE(model);
  EXPECT_LT((model->frames.at(0).R - GetParam().expected).cwiseAbs().maxCoeff(), 1e-9)
      << model->frames[0].R;
}

INSTANTIATE_TEST_SUITE_P(
    Manual, OrientationForm,
    testing::Values(
        RotationCase{"1, 1.,1.,0., 2, 0.,1.,0.",
                     rows({.707106781, -.707106781, 0, .707106781, .707106781, 0, 0, 0, 1})},
        RotationCase{"3, 1.,2.,3., 1, 1.,0.,0.",
                     rows({.963624112, 0, .267261242, -.148249863, .832050294, .534522484,
                           -.222374795, -.554700196, .801783726})},
        RotationCase{"3, 0.,1.,0., 1, .5, sqrt(3)/2., 0.", rows({1, 0, 0, 0, 0, 1, 0, -1, 0})},
        RotationCase{"1, 1.,2.,3., 2, guess",
                     rows({.267261242, .948683298, -.169030851, .534522484, 0, .845154255,
                           .801783726, -.316227766, -.507092553})},
        RotationCase{"1, 1.,1.,1., 2, guess",
                     rows({.577350269, -.707106781, -.40824829, .577350269, .707106781, -.40824829,
                           .577350269, 0, .816496581})},
        RotationCase{"3, -3.,0.,2., 1, guess",
                     rows({0, -.554700196, -.832050294, 1, 0, 0, 0, -.832050294, .554700196})},
        RotationCase{"1, 0.,2.,-2., 3, guess",
                     rows({0, 0, 1, .707106781, .707106781, 0, -.707106781, .707106781, 0})},
        RotationCase{"1, 2.,-1.,-3., 2, guess",
                     rows({.534522484, 0, .845154255, -.267261242, .948683298, .169030851,
                           -.801783726, -.316227766, .507092553})},
        RotationCase{"euler, .1,.2,.3",
                     rows({.936293364, -.289629478, .198669331, .312991826, .944702486, -.097843395,
                           -.159345079, .153791998, .975170327})},
        RotationCase{"euler, degrees, 10.,20.,30.",
                     rows({.813797681, -.469846310, .342020143, .543838142, .823172945, -.163175911,
                           -.204874129, .318795778, .925416578})},
        RotationCase{"euler313, .1,.2,.3",
                     rows({.921649086, -.387517202, .019833838, .383557042, .902113005, -.197676812,
                           .058710802, .189796061, .980066578})},
        RotationCase{"euler321, .1,.2,.3",
                     rows({.975170327, -.036957014, .218350663, .097843395, .956425086, -.275095847,
                           -.198669331, .289629478, .936293364})},
        RotationCase{"vector, .1,.2,.3",
                     rows({.935754803, -.283164961, .210191706, .302932713, .950580618, -.068031316,
                           -.180540077, .127334575, .975290309})}));

TEST(OrientationForm, RefusesAMatrixThatIsNotOrthogonal) {
  const LoadReport report = load("reference: 1, null, matr, 2.,0.,0., 0.,1.,0., 0.,0.,1.;");
  EXPECT_EQ(
      findings(report.diagnostics),
      "error: reference frame 1: orientation: orientation matrix is not orthogonal (deviation 3)");
}

TEST(OrientationForm, WarnsAboutASlightDeviation) {
  const LoadReport report = load("reference: 1, null, matr, 1.00000002,0.,0., 0.,1.,0., 0.,0.,1.;");
  ASSERT_TRUE(report.ok());
  EXPECT_EQ(findings(report.diagnostics),
            "warning: reference frame 1: orientation: orientation matrix is not orthogonal "
            "(deviation 4e-08)");
}

const char* const kFrames =
    "reference: 10, 1.,2.,3., euler, .1,.2,.3, .4,.5,.6, .7,.8,.9;\n"
    "reference: 20, reference, 10, 1.,1.,1., reference, 10, euler, .3,-.2,.1, reference, 10, "
    ".1,.2,.3, reference, 10, -.1,.5,.2;\n"
    "reference: 30, reference, 20, 2.,0.,-1., reference, 10, eye, reference, 20, null, reference, "
    "global, 0.,0.,1.;\n"
    "reference: 40, reference, 20, 2.,0.,-1., reference, 20, eye, reference, 10, null, reference, "
    "20, null;\n"
    "reference: 51, denavit hartenberg, reference, 10, .5, .3, .7, .2;\n"
    "reference: 60, reference, local, euler, .1,.2,.3, 1.,2.,3., reference, local, euler, "
    ".1,.2,.3,\n"
    "  reference, local, euler, .1,.2,.3, 1.,0.,0., reference, local, euler, .1,.2,.3, 1.,0.,0.;\n";

void expect_near(const Vec3& value, double a, double b, double c) {
  EXPECT_LT((value - Vec3(a, b, c)).norm(), 2e-9) << value.transpose();
}

TEST(ReferenceFrame, ComposesAsTheReferenceSolverDoes) {
  const ModelPtr model = model_of(kFrames);
  ASSERT_TRUE(model);
  const auto frame = [&](int label) {
    for (const ReferenceFrame& f : model->frames)
      if (f.label == label) return f;
    throw std::runtime_error("no frame");
  };
  expect_near(frame(20).x, 1.845333217, 3.159850917, 3.969617246);
  expect_near(frame(20).v, .2271322117, .7729544842, 1.043004058);
  expect_near(frame(20).w, .5012897910, 1.221483381, 1.187864572);
  expect_near(frame(30).x, 3.652890473, 4.224795709, 3.195905831);
  expect_near(frame(30).v, -1.982953614, 3.307941345, -.6310511389);
  expect_near(frame(30).w, 0, 0, 1);
  expect_near(frame(40).x, 3.652890473, 4.224795709, 3.195905831);
  expect_near(frame(40).v, -1.445591474, 2.750467344, .03504461807);
  expect_near(frame(40).w, .5012897910, 1.221483381, 1.187864572);
  expect_near(frame(51).x, 1.665553362, 2.355812133, 3.412839496);
  expect_near(frame(51).v, .4100406772, .8100103784, .3166258036);
  expect_near(frame(51).w, .7, .8, .9);
  expect_near(frame(60).x, .95304240072, 1.9088666128, 3.0737498983);
  expect_near(frame(60).v, .936293364, .312991826, -.159345079);
  expect_near(frame(60).w, .936293364, .312991826, -.159345079);
  const Mat3 r20 = rows({.9457212453, -.3139659115, .0838852343, .3187695535, .8459966618,
                         -.4274056855, .0632241874, .4309466959, .9001597900});
  const Mat3 r51 = rows({.8088838517, -.5028868126, .3046502391, .5781911859, .7744285274,
                         -.2568178510, -.1067795256, .3838818955, .9171874526});
  EXPECT_LT((frame(20).R - r20).norm(), 1e-9);
  EXPECT_LT((frame(40).R - r20).norm(), 1e-9);
  EXPECT_LT((frame(51).R - r51).norm(), 1e-9);
  EXPECT_LT((frame(60).R - rotation_of_euler123(Vec3(.1, .2, .3))).norm(), 1e-12);
}

TEST(ReferenceFrame, CarriesTheVelocityOfItsParent) {
  const ModelPtr model = model_of(
      "reference: 1, null, eye, null, 0.,.2,0.;"
      "reference: 2, reference, 1, 0.,0.,-.5, reference, 1, eye, reference, 1, null, reference, 1, "
      "null;");
  ASSERT_TRUE(model);
  expect_near(model->frames[1].v, -.1, 0, 0);
  expect_near(model->frames[1].w, 0, .2, 0);
}

/// Nodes 1 and 2 and frame 10 of the relative data.
DeckText two_nodes() {
  DeckText deck;
  deck.before =
      "reference: 10, 1.,2.,3., euler, .1,.2,.3, null, null;\nreference: 5, null, euler, "
      ".1,.2,.3;\n";
  deck.nodes =
      "structural: 1, static, .5,.6,.7, euler, .2,.1,-.3, null, null;\n"
      "structural: 2, static, -.5,.3,.2, euler, -.4,.5,.6, null, null;\n"
      "structural: 3, static, null, euler, .3,.2,.1, null, null;\n";
  return deck;
}

struct RelativeCase {
  const char* text;
  Vec3 offset;
  Mat3 orientation;
};

class RelativeData : public testing::TestWithParam<RelativeCase> {};

TEST_P(RelativeData, OfTheSecondNodeIsInItsFrame) {
  const std::string found = probe(two_nodes(), GetParam().text, [](Card& card) {
    const OtherNode first{0, Vec3(.1, .2, .3), rotation_of_euler123(Vec3(.3, .2, .1))};
    const Vec3 offset = card.relative_position("offset", 1, &first);
    EXPECT_TRUE(card.keyword("orientation"));
    const Mat3 r = card.relative_orientation("orientation", 1, &first);
    EXPECT_LT((offset - GetParam().offset).norm(), 3e-9) << offset.transpose();
    EXPECT_LT((r - GetParam().orientation).norm(), 3e-9) << r;
  });
  EXPECT_EQ(found, "");
}

INSTANTIATE_TEST_SUITE_P(
    Manual, RelativeData,
    testing::Values(
        RelativeCase{"reference, global, 1.,2.,3., orientation, reference, global, eye",
                     Vec3(.0724851634, .526457506, 3.563367564),
                     rows({.7243001434, .3659823932, -.5843339715, -.4955203884, .8656015533,
                           -.0720659115, .4794255386, .3417467465, .8083070668})},
        RelativeCase{"reference, 10, 1.,2.,3., orientation, reference, 10, euler, .1,0.,0.",
                     Vec3(-.3347110032, 1.485010882, 7.157163149),
                     rows({.8858176579, -.0002272627, -.4640334312, -.1815428922, .9201239482,
                           -.3470073460, .4270471346, .3916272057, .8150207830})},
        RelativeCase{"reference, local, euler, 0.,0.,.1, 1.,2.,3., orientation, reference, local, "
                     "euler, .1,0.,0.",
                     Vec3(.7953373320, 2.089841747, 3), rotation_x(.1)},
        RelativeCase{
            "reference, other node, 1.,2.,3., orientation, reference, other node, euler, .1,0.,0.",
            Vec3(.4382561417, -.5223342774, 4.717928555),
            rows({.6783552063, .4045713281, -.6133157870, -.6943587624, .6259062581, -.3551158474,
                  .2402084993, .6667558748, .7055044155})},
        RelativeCase{"reference, other position, 1.,2.,3., orientation, reference, other "
                     "orientation, euler, .1,0.,0.",
                     Vec3(.4278889683, -.5473804173, 5.091111101),
                     rows({.8236421642, .1392102075, -.5497582227, -.5295409090, .5357534496,
                           -.6576888831, .2029778583, .8328197641, .5149866305})}));

void expect_upper(const Mat3& j, std::initializer_list<double> v) {
  auto x = v.begin();
  for (int i = 0; i < 3; ++i)
    for (int k = i; k < 3; ++k, ++x) {
      EXPECT_NEAR(j(i, k), *x, 2e-9);
      EXPECT_NEAR(j(k, i), *x, 2e-9);
    }
}

TEST(RelativeTensor, TurnsWithItsFrame) {
  EXPECT_EQ(probe(two_nodes(), "reference, global, diag, 1.,2.,3., reference, 5, diag, 1.,2.,3.",
                  [](Card& card) {
                    expect_upper(card.relative_tensor("inertia", 2),
                                 {1.074433687, .0455402682, -.3429301766, 2.088390553, .3124906511,
                                  2.837175760});
                    expect_upper(card.relative_tensor("inertia", 2),
                                 {1.027218597, -.1476246338, .0759639476, 2.013606080, .1979479822,
                                  2.959175323});
                  }),
            "");
}

TEST(UnitVector, IsNormalisedWithAWarning) {
  EXPECT_EQ(probe(two_nodes(), "0.,3.,4.",
                  [](Card& card) {
                    EXPECT_LT((card.absolute_unit_vector("axis") - Vec3(0, .6, .8)).norm(), 1e-15);
                  }),
            "warning: user defined element 1: axis: not a unit vector, normalised");
  EXPECT_EQ(probe(two_nodes(), "null", [](Card& card) { card.absolute_unit_vector("axis"); }),
            "error: user defined element 1: axis: direction is null");
}

/// Of drives: in global components, or along the axes that `reference, node` names.
TEST(VectorDrive, IsReadInAFrame) {
  const Mat3 R = rotation_of_euler123(Vec3(.2, .1, -.3)),
             R10 = rotation_of_euler123(Vec3(.1, .2, .3)), local = rotation_x(.1);
  const Vec3 v(1, 2, 3);
  const std::string numbers = " 1.,2.,3., 1., ";
  const std::string card = "single," + numbers + "single, reference, node," + numbers +
                           "single, reference, local, euler, .1,0.,0.," + numbers +
                           "single, reference, global," + numbers +
                           "array, 1, reference, 10, 1.,2.,3., 1.";
  for (const bool global : {true, false}) {
    const Mat3 to = global ? R : Mat3(Mat3::Identity()),
               back = global ? Mat3(Mat3::Identity()) : Mat3(R.transpose());
    EXPECT_EQ(
        probe(two_nodes(), card,
              [&](Card& card) {
                const EvalContext context;
                for (const Vec3& expected :
                     {v, Vec3(to * v), Vec3(to * local * v), Vec3(back * v), Vec3(back * R10 * v)})
                  EXPECT_LT(
                      (card.vec3_drive("load", {R, global})->value(context) - expected).norm(),
                      1e-14);
              }),
        "");
  }
}

TEST(AbsolutePosition, MayBeGivenInANodesFrame) {
  EXPECT_EQ(probe(two_nodes(), "reference, node, 0.,0.,0., reference, node, eye",
                  [](Card& card) {
                    EXPECT_EQ(card.absolute_position("pin", 1), Vec3(-.5, .3, .2));
                    EXPECT_LT((card.absolute_orientation("pin", 1) -
                               rotation_of_euler123(Vec3(-.4, .5, .6)))
                                  .norm(),
                              1e-15);
                  }),
            "");
}

}  // namespace
}  // namespace mbcosim::decks::frames_test
