/// Each joint between two free bodies: numbers of MBDyn 1.7.3.
#include <algorithm>
#include <array>
#include <cmath>

#include "deck_run.h"
#include "elements/columns.h"

namespace mbcosim::joint_reference_test {
namespace {

struct ReferenceCase {
  const char* name;
  const char* card;
  const char *velocity, *spin;            ///< of body 2 relative to the common frame
  std::array<double, 3> x, angles, v, w;  ///< node 2 at step 51; angles euler123 [degrees]
  std::array<double, 6> first, last;      ///< local reactions at steps 1 and 51
  std::vector<double> extras;             ///< further columns at step 51
};

const ReferenceCase kCases[] = {
    {"Inline",
     "in line, 1, .45,.12,-.17, vector, .5,.1,-.3, 2, offset, .05,.02,.03",
     "null",
     "null",
     {0.517517597, 0.437275353, -0.0276282678},
     {22.8743214, -2.93431707, 16.2834187},
     {0.272647796, -0.220406847, -2.2898894},
     {0.31380802, 0.491604588, -0.412647683},
     {0.0455594785, 0.046708997, 0, 0, 0, 0},
     {0.0219526461, 0.0228961284, 0, 0, 0, 0},
     {}},
    {"Inplane",
     "in plane, 1, .45,.12,-.17, .3,.9,.3, 2, offset, .05,.02,.03",
     "null",
     "null",
     {0.518473006, 0.437388089, -0.0274731729},
     {22.8736014, -2.92755548, 16.2892103},
     {0.280043933, -0.219918147, -2.28899533},
     {0.313707726, 0.492328191, -0.411828576},
     {0.0394268273, 0, 0, 0, 0, 0},
     {0.0237743659, 0, 0, 0, 0, 0},
     {}},
    {"Prismatic",
     "prismatic, 1, hinge, vector, .5,.1,-.3, 2, hinge, vector, .5,.1,-.3",
     ".1,.2,.3",
     "null",
     {0.510431083, 0.466948959, 0.0636124589},
     {22.8343147, -2.91010259, 16.3391722},
     {0.248532817, -0.101210567, -1.9295116},
     {0.307760471, 0.491707864, -0.404433827},
     {0, 0, 0, 0.00862983321, -0.00265412869, -0.00361431466},
     {0, 0, 0, -0.000812089302, 0.00109050492, -0.000476799967},
     {}},
    {"RevoluteHinge",
     "revolute hinge, 1, .45,.12,-.17, hinge, vector, .5,.1,-.3, 2, .05,.02,.03, hinge, "
     "vector, .5,.1,-.3",
     "null",
     "null",
     {0.517514477, 0.437333233, -0.0276819945},
     {22.8920632, -2.94728336, 16.2766384},
     {0.272631355, -0.219992679, -2.29025977},
     {0.316304514, 0.490621107, -0.413821583},
     {-0.0473054334, -0.0513559105, -0.00490719361, 0.0112763998, -0.0041847268, 0},
     {-0.0217958095, -0.0228973881, -0.000804755153, 0.000473849463, -0.000180145194, 0},
     {0, 0, -0.0998199088, -1.40753569e-08, -8.67134465e-08, -0.0139502468}},
    {"AxialRotation",
     "axial rotation, 1, .45,.12,-.17, hinge, vector, .5,.1,-.3, 2, .05,.02,.03, hinge, "
     "vector, .5,.1,-.3, cosine, 0., 8., .2, forever, 0.",
     "null",
     "null",
     {0.519140737, 0.436530295, -0.0288635277},
     {23.3036853, -3.53152886, 17.4737843},
     {0.288047935, -0.228295139, -2.30296231},
     {0.37680195, 0.314644406, -0.26275791},
     {-0.046445024, -0.0545212835, -0.00468804684, 0.0113836872, -0.00399643431, 0.00269624036},
     {-0.0161939588, -0.132580205, -0.00806338853, 0.00643958224, -0.00409310837, 0.0879361735},
     {0, 0, 1.64469458, 0.290435232, 3.3637233e-07, 2.45134398e-06, 0.290435232}},
    {"DriveHinge",
     "drive hinge, 1, hinge, vector, .5,.1,-.3, 2, hinge, vector, .5,.1,-.3, 1.,2.,-1., "
     "cosine, 0., 8., .2, forever, 0.",
     ".1,.2,.3",
     "null",
     {0.495962794, 0.482558432, 0.0404211779},
     {34.820624, 21.9569606, 12.7362357},
     {0.143868438, -0.00775012908, -2.00755069},
     {1.27320759, 2.51662602, 0.338320935},
     {0, 0, 0, -0.820387003, -1.96948392, 1.04965352},
     {0, 0, 0, 0.110199453, 0.458626437, -0.279771916},
     {23.5291099, 29.5162509, -23.5291099, 0.290435232, 0.580870465, -0.290435232}},
    {"CardanoHinge",
     "cardano hinge, 1, .45,.12,-.17, hinge, vector, .5,.1,-.3, 2, .05,.02,.03, hinge, "
     "vector, .5,.1,-.3",
     "null",
     "null",
     {0.517522623, 0.437317247, -0.0276691723},
     {22.8914215, -2.9298781, 16.2836504},
     {0.272678981, -0.220099634, -2.29018103},
     {0.316182523, 0.492151709, -0.412386388},
     {-0.0465479337, -0.0514240288, 0.000681896206, 0.0107717176, 0, 0},
     {-0.0218211293, -0.0229234858, -0.00055807319, 0.000502618974, 0, 0},
     {0, -0.0233117939, 0.102594777}},
    {"SphericalHinge",
     "spherical hinge, 1, .45,.12,-.17, 2, .05,.02,.03",
     "-.004,-.02,.02",
     ".5,.6,.7",
     {0.516877287, 0.430516627, -0.0238089042},
     {25.1541362, 8.58540208, 25.9636965},
     {0.266288243, -0.248158085, -2.2722024},
     {0.406063171, 0.997362538, 0.500999912},
     {-0.0197755561, -0.0516248405, -0.0207615373, 0, 0, 0},
     {0.000714754025, -0.0197542543, -0.0171145268, 0, 0, 0},
     {5.442709, 10.4250718, 9.09853589}},
    {"DeformableHinge",
     "deformable hinge, 1, hinge, vector, .5,.1,-.3, 2, hinge, vector, .5,.1,-.3, linear "
     "viscoelastic generic, diag, 30.,40.,50., proportional, .01",
     "null",
     ".5,.6,.7",
     {0.516407091, 0.428573836, -0.0215300814},
     {23.7488787, 1.06239388, 20.0513094},
     {0.271153418, -0.256379093, -2.25973038},
     {0.290035132, 0.626401119, -0.114582986},
     {0, 0, 0, 0.0851005247, 0.556172651, 0.234109691},
     {0, 0, 0, 0.00642112473, 0.349048748, 0.116257469},
     {0.047511628, 0.527721123, 0.141129836, -0.0626534095, -0.0483225986, -0.0141832197}},
    {"DeformableDisplacementJoint",
     "deformable displacement joint, 1, .45,.12,-.17, hinge, vector, .5,.1,-.3, 2, "
     ".05,.02,.03, hinge, vector, .5,.1,-.3, linear viscoelastic generic, diag, "
     "30.,40.,50., proportional, .01",
     "null",
     ".5,.6,.7",
     {0.516323293, 0.434642292, -0.0254999723},
     {25.1869962, 8.42154793, 25.8732783},
     {0.261097282, -0.242513593, -2.27743036},
     {0.409459125, 0.986603694, 0.48042036},
     {0.000880090548, 0.00546761724, -0.0201685501, 0, 0, 0},
     {0.0328597957, 0.0634800419, 0.0202833023, 0, 0, 0},
     {0.00107215073, 0.00164864604, 0.00020569647, 0.00231757914, -0.00616449905, 0.0199969575}},
    {"DeformableJoint",
     "deformable joint, 1, .45,.12,-.17, hinge, vector, .5,.1,-.3, 2, .05,.02,.03, hinge, "
     "vector, .5,.1,-.3, linear viscoelastic generic, diag, 30.,40.,50.,20.,25.,35., "
     "proportional, .02",
     "null",
     ".5,.6,.7",
     {0.507853455, 0.442201893, -0.0277044164},
     {23.9625259, -0.326184778, 18.6914109},
     {0.195690585, -0.126259929, -2.31686636},
     {0.416535586, 0.586003013, -0.287377377},
     {0.00515544232, 0.00382122207, -0.0202456334, 0.0929017904, 0.572802173, 0.267559492},
     {0.059911178, -0.0923008271, 0.0690347901, 0.01030805, 0.13106403, 0.064654572},
     {0.00343652904, -0.00312613049, 0.0047021635, -0.0253649143, 0.195570945, 0.0889002583,
      -0.0719744886, 0.0409304907, -0.166073385, 0.0477727581, 0.0914430799, 0.0148214177}},
    {"TotalJointA",
     "total joint, 1, position, .45,.12,-.17, position orientation, vector, .5,.1,-.3, "
     "rotation orientation, vector, .5,.1,-.3, 2, position, .05,.02,.03, position "
     "orientation, vector, .5,.1,-.3, rotation orientation, vector, .5,.1,-.3, position "
     "constraint, active, active, active, 1.,2.,-1., cosine, 0., 8., .2, forever, 0., "
     "orientation constraint, active, active, active, .5,-1.,.7, cosine, 0., 8., .2, "
     "forever, 0.",
     "null",
     "null",
     {0.740733972, 0.821802508, -0.0176956202},
     {23.3304614, -16.3617289, 12.6936216},
     {1.51224503, 1.69550787, -2.34022646},
     {0.684616349, -0.66818475, -0.802621796},
     {-15.5613069, -19.8141058, 16.5131523, -0.471843224, 3.36615165, 2.20186366},
     {3.35464553, 5.07847021, -3.66288201, 0.42853798, -0.774118047, -0.354643887},
     {0.290435232, 0.580870465, -0.290435232, 0.145217616, -0.290435232, 0.203304663, 1.42746107,
      2.85450021, -1.42736625, 0.713617124, -1.42732836, 0.999118651}},
    {"TotalJointB",
     "total joint, 1, position, .45,.12,-.17, position orientation, vector, .5,.1,-.3, "
     "rotation orientation, vector, .5,.1,-.3, 2, position, .05,.02,.03, position "
     "orientation, vector, .5,.1,-.3, rotation orientation, vector, .5,.1,-.3, position "
     "constraint, active, inactive, active, 1.,2.,-1., cosine, 0., 8., .2, forever, 0., "
     "orientation constraint, active, inactive, active, .5,-1.,.7, cosine, 0., 8., .2, "
     "forever, 0.",
     "null",
     "null",
     {0.709099061, 0.595714287, -0.125186686},
     {36.5528325, 5.38793217, 34.628384},
     {1.23447052, 0.56696229, -2.74584336},
     {1.43532821, 0.369117945, 1.49177694},
     {-13.597412, 0, 10.0727105, -0.976059528, 0, -1.71805082},
     {3.03228238, 0, -2.50128265, 0.239917778, 0, 0.322472214},
     {0.290435232, -0.0272297505, -0.290435232, 0.146080267, 0.319126675, 0.202752103, 1.42733475,
      -0.173429466, -1.42728993, 0.710880715, 1.627432, 1.00307817}},
    {"TotalJointC",
     "total joint, 1, position, .45,.12,-.17, position orientation, vector, .5,.1,-.3, "
     "rotation orientation, vector, .5,.1,-.3, 2, position, .05,.02,.03, position "
     "orientation, vector, .5,.1,-.3, rotation orientation, vector, .5,.1,-.3, position "
     "constraint, velocity, active, inactive, 1.,2.,-1., cosine, 0., 8., .2, forever, 0., "
     "orientation constraint, angular velocity, active, inactive, .5,-1.,.7, cosine, 0., "
     "8., .2, forever, 0.",
     "null",
     "null",
     {0.668955611, 0.621935001, 0.134669248},
     {11.7978669, -11.1222836, 27.2559799},
     {1.49150482, 0.871043349, -1.50230772},
     {-0.794231397, -0.130917232, 0.539273727},
     {-2.7021113, -14.2223006, 0, 0.730038564, 0.752098492, 0},
     {-0.597238062, 2.57042712, 0, 0.0614480945, -0.243278684, 0},
     {0.0287360782, 0.580870465, 0.231932282, 0.00429285277, -0.290506795, 0.487630014, 0.290435232,
      2.85455089, 1.96469789, 0.145217616, -1.40636332, 1.35192613}},
};

class JointReference : public testing::TestWithParam<ReferenceCase> {};

std::string reference_deck(const ReferenceCase& c) {
  return std::string(R"(begin: data; problem: initial value; end: data;
begin: initial value;
  initial time: 0.; final time: .2501; time step: 5e-3; method: ms, .6; tolerance: 1e-9; max iterations: 50;
  derivatives tolerance: 1e-3; derivatives max iterations: 50; derivatives coefficient: 1e-3;
end: initial value;
begin: control data; structural nodes: 2; rigid bodies: 2; joints: 1; gravity; skip initial joint assembly; end: control data;
reference: 1, .1,.2,.3, vector, .3,-.2,.4, .2,-.1,.3, .3,.5,-.4;
begin: nodes;
  structural: 1, dynamic, reference, 1, null, reference, 1, eye, reference, 1, null, reference, 1, null;
  structural: 2, dynamic, reference, 1, .4,.1,-.2, reference, 1, eye, reference, 1, )") +
         c.velocity + ", reference, 1, " + c.spin + R"(;
end: nodes;
begin: elements;
  gravity: uniform, 0.,0.,-1., 9.81;
  body: 1, 1, 1.5, .02,-.03,.01, diag, .11,.12,.13;
  body: 2, 2, .8, -.04,.05,.02, diag, .05,.06,.07;
  joint: 1, )" +
         c.card + ";\nend: elements;\n";
}

/// Velocities and reactions agree to the noise of the reference's start, whose constraint rows
/// divide rounding errors by the square of its coefficient.
TEST_P(JointReference, AgreesAfterAQuarterOfASecond) {
  const ReferenceCase& c = GetParam();
  DeckRun run(reference_deck(c));
  ASSERT_TRUE(run.ready());
  const auto columns = [&] {
    decks::Columns row;
    const ElementRef e = run.model().find_element(Family::joint, 1);
    e.set->output(run.context(), e.index, row);
    return row.v;
  };
  run.step(1);
  const std::vector<double> first = columns();
  run.step(50);
  const std::vector<double> last = columns();
  const NodeState n = run.node(2);
  const Vec3 angles = kDegrees * euler123_of_rotation(n.R);
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(n.x(i), c.x[i], 2e-8) << "x " << i;
    EXPECT_NEAR(angles(i), c.angles[i], 5e-6) << "angle " << i;
    EXPECT_NEAR(n.v(i), c.v[i], 5e-7) << "v " << i;
    EXPECT_NEAR(n.w(i), c.w[i], 5e-7) << "w " << i;
  }
  for (int i = 0; i < 6; ++i) {
    EXPECT_NEAR(first[i], c.first[i], 1e-5 * std::max(1.0, std::abs(c.first[i])))
        << "first reaction " << i;
    EXPECT_NEAR(last[i], c.last[i], 1e-5 * std::max(1.0, std::abs(c.last[i])))
        << "last reaction " << i;
  }
  ASSERT_EQ(last.size(), 12 + c.extras.size());
  for (std::size_t i = 0; i < c.extras.size(); ++i)
    EXPECT_NEAR(last[12 + i], c.extras[i], 2e-6 * std::max(1.0, std::abs(c.extras[i])))
        << "extra column " << i;
}

/// Forces and moments that drives can read are those that are printed.
TEST_P(JointReference, PrivateReactionsAreThePrintedOnes) {
  DeckRun run(reference_deck(GetParam()));
  ASSERT_TRUE(run.ready());
  run.step(51);
  decks::Columns row;
  const ElementRef e = run.model().find_element(Family::joint, 1);
  e.set->output(run.context(), e.index, row);
  const std::vector<std::string> names = e.set->data_names(e.index);
  for (const std::string& name : names) {
    const int datum = e.set->private_datum(e.index, name);
    ASSERT_GE(datum, 0) << name;
    const double value = e.set->private_value(run.context(), e.index, datum);
    EXPECT_TRUE(std::isfinite(value)) << name;
    if (name[0] != 'F' && name[0] != 'M') continue;
    EXPECT_TRUE(std::any_of(row.v.begin(), row.v.begin() + 12,
                            [&](double x) { return std::abs(x - value) <= 1e-12; }))
        << name << " = " << value;
  }
  EXPECT_EQ(e.set->private_datum(e.index, "Fw"), -1);
}

INSTANTIATE_TEST_SUITE_P(Joints, JointReference, testing::ValuesIn(kCases),
                         [](const auto& info) { return std::string(info.param.name); });

}  // namespace
}  // namespace mbcosim::joint_reference_test
