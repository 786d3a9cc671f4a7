/// Motions of modal bodies against the reference solver's numbers.
#include <gtest/gtest.h>

#include "elements/modal_deck.h"

namespace mbcosim::modal_deck_test {
namespace {

using decks::digits;
using decks::generic_body;
using decks::hand_made;
using decks::ModalDeck;
using decks::ModalRun;
using decks::Placement;

const std::string kHalfSine = ", sine, 0., pi/.1, 1., one, 0.;\n";

std::string fem(const FemData& data) { return write_fem_text(data, {}); }

FemData coarse_body() {
  FemData d = hand_made(true);
  d.lumped.reset();
  d.rigid = hand_made(false).rigid;
  return d;
}

// ------------------------------------------------------------------------------------------------
// the tutorials' two bodies

/// t, q1, p1, y, z, rotation about x [degrees], w_x of the modal node, y, z of the interface node
struct TutorialRow {
  double t, q, p, y, z, angle, w, y_end, z_end;
};

void expect_tutorial(ModalRun& run, int first, const std::vector<TutorialRow>& rows) {
  for (const TutorialRow& row : rows) {
    run.to(row.t);
    const std::string when = "t = " + digits(row.t);
    const NodeState frame = run.node(first + 1), end = run.node(first + 2);
    EXPECT_NEAR(run.q(1, first), row.q, 1e-12 + 1e-10 * std::abs(row.q)) << when;
    EXPECT_NEAR(run.p(1, first), row.p, 1e-7 + 1e-9 * std::abs(row.p)) << when;
    EXPECT_NEAR(frame.x.y(), row.y, 2e-12) << when;
    EXPECT_NEAR(frame.x.z(), row.z, 2e-10) << when;
    EXPECT_NEAR(run.euler_degrees(first + 1).x(), row.angle, 2e-9) << when;
    EXPECT_NEAR(frame.w.x(), row.w, 1e-11) << when;
    EXPECT_NEAR(end.x.y(), row.y_end, 1e-9) << when;
    EXPECT_NEAR(end.x.z(), row.z_end, 1e-9) << when;
    EXPECT_EQ(run.q(2, first), 0) << when;
  }
}

ModalDeck tutorial_deck() {
  ModalDeck deck;
  deck.tolerance = 1e-11;
  deck.initial_value = "derivatives coefficient: 1.e-6;";
  deck.files = {{"static.fem", fem(hand_made(false))}, {"dynamic.fem", fem(hand_made(true))}};
  for (const int first : {10, 20}) {
    const double x = first / 10 - 1;
    deck.node(first + 1, "modal", {Vec3(x, 0, 0)});
    deck.node(first + 2, "static", {Vec3(x, 2, 0)});
    const std::string label = std::to_string(first), end = std::to_string(first + 2);
    deck.joints += "joint: " + label + ", modal, " + std::to_string(first + 1) +
                   ", 2, 3, no damping, \"" + (first == 10 ? "static" : "dynamic") +
                   ".fem\", 1, 1003, " + end + ", null;\n";
    deck.forces +=
        "force: " + label + ", follower, " + end + ", position, null, 0.,0.,1." + kHalfSine;
  }
  return deck;
}

TEST(ModalDecks, TutorialsStaticBody) {
  ModalRun run(tutorial_deck());
  ASSERT_TRUE(run.ready());
  run.to(.01);
  EXPECT_NEAR(run.p_rate(1, 10), 12360.67977, 1e-5);
  expect_tutorial(run, 10,
                  {{0.01, 3.090169944e-01, 6.180339887e+01, -3.617102379e-12, 2.575141620e-06,
                    8.047895262e-05, 2.809245403e-04, 1.999999566, 3.090223788e-01},
                   {0.02, 5.877852523e-01, 2.636438897e+01, -9.066706255e-11, 1.671948137e-05,
                    5.225213008e-04, 1.087033026e-03, 1.999994639, 5.878202112e-01},
                   {0.05, 1.000000000e+00, 2.395464597e-01, -5.932975041e-09, 1.973665905e-04,
                    6.168148727e-03, 5.640802314e-03, 1.999892328, 1.000412670e+00},
                   {0.10, 0, -3.241413626e+01, -9.839002164e-08, 1.032516761e-03, 3.226846543e-02,
                    1.120823062e-02, 1.999999584, 2.158898633e-03},
                   {0.20, 0, 0, -3.991575005e-07, 3.106660663e-03, 9.709011679e-02, 1.133908372e-02,
                    1.999996729, 6.495743459e-03},
                   {1.0, 0, 0, -2.818476539e-06, 1.973731952e-02, 6.168355254e-01, 1.133908594e-02,
                    1.999881280, 4.126852531e-02},
                   {5.0, 0, 0, -1.491507212e-05, 1.028906149e-01, 3.215562602, 1.133908594e-02,
                    1.996836215, 2.150760110e-01},
                   {10.0, 0, 0, -3.003581660e-05, 2.068322340e-01, 6.463971448, 1.133908594e-02,
                    1.987255651, 4.319890674e-01}});
}

TEST(ModalDecks, TutorialsDynamicBody) {
  ModalRun run(tutorial_deck());
  ASSERT_TRUE(run.ready());
  expect_tutorial(run, 20,
                  {{0.01, 3.862567583e-06, 7.725135167e-04, 1.085076459e-11, 9.656422007e-11,
                    8.047895262e-05, 2.809245403e-04, 2.000000000, 6.671909551e-06},
                   {0.02, 2.507709961e-05, 2.989051425e-03, 3.056999483e-10, 1.414964893e-09,
                    5.225213009e-04, 1.087033026e-03, 2.000000000, 4.331794880e-05},
                   {0.05, 2.959647528e-04, 1.550557293e-02, 2.328479334e-08, 5.675746937e-08,
                    6.168148768e-03, 5.640802392e-03, 1.999999980, 5.113305177e-04},
                   {0.10, 1.547066796e-03, 3.075080803e-02, 5.268357259e-07, 1.139086447e-06,
                    3.226846905e-02, 1.120823398e-02, 1.999999338, 2.674587637e-03},
                   {0.20, 4.631619790e-03, 3.064694767e-02, 4.882648357e-06, 1.891865136e-05,
                    9.709020288e-02, 1.133911329e-02, 1.999994163, 8.039617593e-03},
                   {1.0, 2.335806411e-02, 1.236443351e-02, 1.648519042e-04, 4.166179450e-03,
                    6.168521562e-01, 1.133983586e-02, 1.999797474, 4.905467615e-02},
                   {5.0, -5.581930189e-03, 3.040836996e-02, -2.236047952e-04, 1.066060448e-01,
                    3.215693257, 1.133912885e-02, 1.996940388, 2.132228534e-01},
                   {10.0, -9.447971590e-03, 2.893940607e-02, -7.390956151e-04, 2.130908419e-01,
                    6.464232313, 1.133920870e-02, 1.987609246, 4.288688188e-01}});
  EXPECT_NEAR(run.p_rate(1, 20), 1.417438698e-02, 1e-10);
}

// ------------------------------------------------------------------------------------------------
// one body of the hand-made shape, node 101 on its FEM node 1003

ModalDeck one_body(const FemData& data, const Vec3& w, const std::string& more = "") {
  ModalDeck deck;
  deck.files = {{"body.fem", fem(data)}};
  deck.node(1, "modal", {Vec3::Zero(), Mat3::Identity(), Vec3::Zero(), w});
  deck.node(101, "static", {Vec3(0, 2, 0), Mat3::Identity(), w.cross(Vec3(0, 2, 0)), w});
  deck.joints =
      "joint: 1, modal, 1, 2, 3, no damping, \"body.fem\", 1, 1003, 101, null" + more + ";\n";
  return deck;
}

/// t, q1, q2, p1, p2, position of the modal node, w_x
struct SpinRow {
  double t, q1, q2, p1, p2, x, y, z, w;
};

void expect_spin(const FemData& data, const std::string& more, const std::vector<SpinRow>& rows,
                 double spin_at_1s, const Vec3& end_at_1s) {
  ModalDeck deck = one_body(data, Vec3(0, 0, 5), more);
  deck.h = 1e-3;
  deck.forces = "force: 1, follower, 101, position, null, 1.,0.,1." + kHalfSine;
  ModalRun run(deck);
  ASSERT_TRUE(run.ready());
  for (const SpinRow& row : rows) {
    run.to(row.t);
    const std::string when = "t = " + digits(row.t);
    const NodeState frame = run.node(1);
    EXPECT_NEAR(run.q(1), row.q1, 1e-10) << when;
    EXPECT_NEAR(run.q(2), row.q2, 1e-10) << when;
    EXPECT_NEAR(run.p(1), row.p1, 1e-10) << when;
    EXPECT_NEAR(run.p(2), row.p2, 1e-10) << when;
    EXPECT_LT((frame.x - Vec3(row.x, row.y, row.z)).norm(), 1e-10) << when;
    EXPECT_NEAR(frame.w.x(), row.w, 1e-10) << when;
  }
  EXPECT_NEAR(run.node(1).w.z(), spin_at_1s, 1e-8);
  EXPECT_LT((run.node(101).x - end_at_1s).norm(), 2e-9);
}

TEST(ModalDecks, LargeSpinOfTheDetailedBody) {
  expect_spin(hand_made(true), "",
              {{.1, 1.589552853e-03, 1.393670200e-03, 3.175377805e-02, 2.307564747e-02,
                2.182912137e-04, -2.322339255e-04, 9.174183499e-07, 1.114338696e-02},
               {.5, 1.360925585e-02, 1.721901174e-04, 2.709923399e-02, 3.024746830e-02,
                9.263477605e-03, 2.235918840e-03, 4.741361064e-04, 1.121913320e-02},
               {1, 2.386155269e-02, 1.639962961e-03, 1.259410356e-02, 1.978505715e-02,
                1.910320854e-02, 5.910849778e-03, 4.245522572e-03, 1.105289046e-02}},
              4.988429335, Vec3(1.943534753, 5.506717556e-01, 2.350295892e-02));
}

TEST(ModalDecks, LargeSpinWithSecondOrderInertia) {
  expect_spin(hand_made(true), ", use invariant 9",
              {{.1, 1.589434505e-03, 1.464967865e-03, 3.174739596e-02, 2.617860166e-02,
                1.765745134e-04, -2.550153044e-04, 9.922649179e-07, 1.114515503e-02},
               {.5, 1.359453858e-02, -2.628219085e-03, 2.709515813e-02, 9.734820179e-03,
                7.773717182e-03, 3.360827954e-03, 4.909440658e-04, 1.118652717e-02},
               {1, 2.383840064e-02, -2.587629795e-03, 1.259098179e-02, -1.116624054e-02,
                1.987313080e-02, 3.200159526e-03, 4.267294801e-03, 1.119622673e-02}},
              4.988425391, Vec3(1.943151398, 5.520226854e-01, 2.348987189e-02));
}

TEST(ModalDecks, LargeSpinOfTheCoarseBody) {
  expect_spin(coarse_body(), "",
              {{.1, 1.590515155e-03, 1.539654400e-03, 3.179685952e-02, 2.949954042e-02,
                1.034059119e-03, 2.122961468e-04, 1.060698174e-03, 1.114513464e-02},
               {1, 2.800670317e-02, 1.870861282e-03, 2.490716647e-02, 2.853020686e-02,
                1.942738707e-02, 4.903822834e-03, 2.015561853e-02, 1.114651695e-02}},
              4.988427632, Vec3(1.943929412, 5.494515862e-01, 4.355571655e-02));
}

/// The modal node of a coarse body moves like that of the massless shapes.
TEST(ModalDecks, CoarseBodyWithoutSpin) {
  ModalDeck deck = one_body(coarse_body(), Vec3::Zero());
  deck.forces = "force: 1, follower, 101, position, null, 0.,0.,1." + kHalfSine;
  ModalRun run(deck);
  ASSERT_TRUE(run.ready());
  const double rows[][3] = {{.01, 3.862664146e-06, 9.247051170e-06},
                            {.1, 1.548205557e-03, 3.707103945e-03},
                            {.5, 1.377761221e-02, 3.331308253e-02},
                            {1, 2.742682013e-02, 6.869375604e-02},
                            {2, 4.327847768e-02, 1.279997413e-01}};
  for (const auto& [t, q, z] : rows) {
    run.to(t);
    EXPECT_NEAR(run.q(1), q, 1e-10) << t;
    EXPECT_NEAR(run.node(101).x.z(), z, 1e-9) << t;
    if (t == 1) {
      EXPECT_NEAR(run.node(1).x.z(), 1.973731952e-02, 1e-9);
    }
  }
}

ModalDeck pendulum(const FemData& data, bool pinned = true) {
  ModalDeck deck = one_body(data, Vec3::Zero());
  deck.h = 5e-3;
  deck.initial_value =
      "derivatives tolerance: 1e12;";  // accelerations start from zero, as MBDyn's do
  if (pinned) deck.joints += "joint: 2, pin, 101, null, 0.,2.,0.;\n";
  deck.others = "gravity: uniform, 0.,0.,-1., const, 9.81;\n";
  return deck;
}

TEST(ModalDecks, PendulumUnderGravity) {
  struct Row {
    double t, q, p, y, z, angle, w, Fy, Fz;
  };
  const std::vector<Row> detailed = {
      {.1, 2.636561306e-02, 5.455724395e-01, 3.452339176e-04, -4.556272639e-02, 5.500000330e-01,
       1.988762856e-01, -6.773545017e-01, -1.138127168e+01},
      {.5, 6.706198722e-01, 2.541539378e+00, 2.364456462e-01, -1.157413951e+00, 1.473992239e+01,
       1.053827088e+00, -1.732293790e+01, -1.688802472e+01},
      {1, 1.862150269e+00, 8.301614597e-01, 2.772908893e+00, -2.621109587e+00, 6.347381634e+01,
       2.368382074e+00, -9.759978254e+00, -7.104924410e+01},
      {2, -2.110455136e+00, -6.663342414e+00, 3.932365390e+00, -2.172552618e+00, 1.781905913e+02,
       1.281977919e+00, -5.097973410e+00, -2.475026526e+01}};
  const std::vector<Row> coarse = {
      {.5, 5.080640395e-01, 2.085384163e+00, 1.226946861e-01, -8.566526872e-01, 1.027471603e+01,
       6.869883002e-01, -1.608472523e+01, -1.295279908e+01},
      {2, 9.969645675e+00, 9.724170790e+00, 5.512872637e+00, -9.542198945e+00, 3.155419532e+01,
       -1.685492458e-01, 5.754755617e+00, -1.587615410e+01}};
  for (const auto& [data, rows] : {std::pair{hand_made(true), detailed}, {coarse_body(), coarse}}) {
    ModalRun run(pendulum(data));
    ASSERT_TRUE(run.ready());
    for (const Row& row : rows) {
      run.to(row.t);
      const std::string when = "t = " + digits(row.t);
      EXPECT_NEAR(run.q(1), row.q, 1e-8) << when;
      EXPECT_NEAR(run.p(1), row.p, 1e-8) << when;
      EXPECT_NEAR(run.node(1).x.y(), row.y, 1e-8) << when;
      EXPECT_NEAR(run.node(1).x.z(), row.z, 1e-8) << when;
      EXPECT_NEAR(run.euler_degrees(1).x(), row.angle, 1e-6) << when;
      EXPECT_NEAR(run.node(1).w.x(), row.w, 1e-8) << when;
      EXPECT_NEAR(run.force(2).y(), row.Fy, 1e-6) << when;
      EXPECT_NEAR(run.force(2).z(), row.Fz, 1e-6) << when;
    }
  }
}

/// A detailed body does not deform in uniform gravity. The lag in velocity is that of MBDyn's start
/// from zero accelerations.
TEST(ModalDecks, FreeFall) {
  ModalRun run(pendulum(hand_made(true), false));
  ASSERT_TRUE(run.ready());
  run.to(.5);
  EXPECT_NEAR(run.node(1).x.z(), -1.208070844, 1e-9);
  run.to(2);
  EXPECT_NEAR(run.node(1).x.z(), -19.54663959, 1e-8);
  for (const int mode : {1, 2}) EXPECT_LT(std::abs(run.q(mode)), 1e-13);
}

/// With a proper start (MBDyn does not converge there) the fall is exact: the derivatives phase
/// finds the acceleration.
TEST(ModalDecks, FreeFallWithConsistentStart) {
  ModalDeck deck = pendulum(hand_made(true), false);
  deck.initial_value = "derivatives tolerance: 1e-6; derivatives max iterations: 20;";
  ModalRun run(deck);
  ASSERT_TRUE(run.ready());
  run.to(2);
  EXPECT_NEAR(run.node(1).x.z(), -.5 * 9.81 * 4, 1e-6);
}

// ------------------------------------------------------------------------------------------------
// clamped

ModalDeck clamped(const FemData& data, const std::string& damping) {
  ModalDeck deck;
  deck.files = {{"body.fem", fem(data)}};
  deck.joints = "joint: 1, modal, clamped, 2, 3, " + damping + ", \"body.fem\", 0;\n";
  deck.others = "gravity: uniform, component, const, 1., const, 0., const, -9.81;\n";
  return deck;
}

TEST(ModalDecks, ClampedUnderGravityWithDamping) {
  struct Case {
    const char* damping;
    double q1[3], q2[3];
  };
  const Case cases[] = {{"no damping",
                         {-1.213491136e+00, -4.703853493e+00, -1.655993103e+01},
                         {3.850626947e-02, 5.738462164e-03, 1.963419089e-02}},
                        {"rayleigh damping, .3, .02",
                         {-1.153237476e+00, -4.257009093e+00, -1.371389637e+01},
                         {3.395944195e-02, 1.166016048e-02, 1.907014975e-02}},
                        {"single factor damping, .05",
                         {-1.199335151e+00, -4.595824903e+00, -1.583317320e+01},
                         {3.586317713e-02, 9.392978614e-03, 1.914992280e-02}},
                        {"diag damping, 1, 2, .1",
                         {-1.213491136e+00, -4.703853493e+00, -1.655993103e+01},
                         {3.362068108e-02, 1.203342347e-02, 1.907750569e-02}},
                        {"diag damping, all, .05, .05",
                         {-1.199335151e+00, -4.595824903e+00, -1.583317320e+01},
                         {3.586317713e-02, 9.392978614e-03, 1.914992280e-02}}};
  for (const Case& c : cases) {
    ModalRun run(clamped(hand_made(true), c.damping));
    ASSERT_TRUE(run.ready());
    const double times[] = {.5, 1, 2};
    for (int k = 0; k < 3; ++k) {
      run.to(times[k]);
      EXPECT_NEAR(run.q(1), c.q1[k], 1e-8) << c.damping;
      EXPECT_NEAR(run.q(2), c.q2[k], 1e-10) << c.damping;
    }
  }
}

TEST(ModalDecks, ClampedStartsWithTheDerivativesPhase) {
  ModalRun run(clamped(hand_made(true), "no damping"));
  ASSERT_TRUE(run.ready());
  EXPECT_NEAR(run.q(1), -9.81e-16, 1e-19);
  EXPECT_NEAR(run.p(1), -9.81e-08, 1e-12);
  run.to(.01);
  EXPECT_NEAR(run.q(1), -4.904948498e-04, 1e-12);
  EXPECT_NEAR(run.p(1), -9.809887186e-02, 1e-10);
}

/// Gravity loads modes through the lumped masses only.
TEST(ModalDecks, GravityDoesNotLoadACoarseBody) {
  ModalRun run(clamped(coarse_body(), "no damping"));
  ASSERT_TRUE(run.ready());
  run.to(1);
  EXPECT_EQ(run.q(1), 0);
  EXPECT_EQ(run.q(2), 0);
}

/// Damping from record group 13, with the keyword, without any, and switched off.
TEST(ModalDecks, DampingOfTheFile) {
  FemData data = hand_made(true);
  data.damping = .3 * data.mass + .02 * data.stiffness;
  for (const std::string damping : {"damping from file, ", "", "no damping, "}) {
    ModalDeck deck = clamped(data, "");
    deck.joints = "joint: 1, modal, clamped, 2, 3, " + damping + "\"body.fem\", 0;\n";
    ModalRun run(deck);
    ASSERT_TRUE(run.ready());
    run.to(2);
    EXPECT_NEAR(run.q(1), damping == "no damping, " ? -1.655993103e+01 : -1.371389637e+01, 1e-7)
        << damping;
  }
}

// ------------------------------------------------------------------------------------------------
// four nodes, three modes, all invariants

const Vec3 kTip(1.5, 0, .1);

Mat3 turned(double angle) { return rotation_of_vector<double>(angle * Vec3(1, 2, 3).normalized()); }

const std::string kLoads =
    "force: 1, follower, 101, position, null, 3.,-4.,5., const, 1.;\n"
    "couple: 2, follower, 101, .3,.2,-.5, const, 1.;\n";

ModalDeck generic_deck(const Mat3& R, const Vec3& v, const Vec3& o = Vec3::Zero()) {
  ModalDeck deck;
  deck.h = 2e-3;
  deck.initial_value = "derivatives tolerance: 1e12;";
  deck.files = {{"body.fem", fem(generic_body())}};
  const Vec3 w(3, -5, 12), end = R * (kTip - o);
  deck.node(1, "modal", {Vec3::Zero(), R, v, w});
  deck.node(101, "static", {end, R, v + w.cross(end), w});
  deck.joints = "joint: 1, modal, 1, 3, from file, no damping, \"body.fem\", 1, \"tip\", 101, " +
                digits(o) + ";\n";
  return deck;
}

/// t, q1..q3, x, y, z, w of the modal node
struct GenericRow {
  double t, q1, q2, q3, x, y, z, wx, wy, wz;
};
void expect_generic(ModalRun& run, const std::vector<GenericRow>& rows) {
  ASSERT_TRUE(run.ready());
  for (const GenericRow& row : rows) {
    run.to(row.t);
    const std::string when = "t = " + digits(row.t);
    EXPECT_LT((Vec3(run.q(1), run.q(2), run.q(3)) - Vec3(row.q1, row.q2, row.q3)).norm(), 1e-10)
        << when;
    EXPECT_LT((run.node(1).x - Vec3(row.x, row.y, row.z)).norm(), 2e-9) << when;
    EXPECT_LT((run.node(1).w - Vec3(row.wx, row.wy, row.wz)).norm(), 2e-8) << when;
  }
}

TEST(ModalDecks, GenericBodyThrownWithSpin) {
  ModalRun run(generic_deck(Mat3::Identity(), Vec3(1, 2, 3)));
  expect_generic(run, {{.002, -6.166276947e-05, 3.352517849e-05, 2.889146631e-04, 2.062215413e-03,
                        4.009702387e-03, 6.001389822e-03, 2.885967450, -4.953874283, 12.02591496},
                       {.02, -9.984183772e-03, 5.462977858e-03, 4.111487494e-02, 3.199769162e-02,
                        4.227920511e-02, 6.068867229e-02, 1.719457430, -4.246985684, 12.26834900},
                       {.1, 1.146185110e-02, 1.769733244e-03, 5.467605781e-02, 5.221551508e-01,
                        4.245246660e-01, 4.066494093e-01, 2.887917907, -0.7245004152, 13.28377212},
                       {.2, 1.310131429e-02, 2.256363261e-02, 7.032530910e-02, 1.320828525,
                        1.637541585, 1.164051419, -4.745423861, -1.308374670, 12.44174966}});
  EXPECT_LT((run.node(101).x - Vec3(0.1229933915, 2.500183229, 1.579519201)).norm(), 2e-9);
  EXPECT_LT((run.euler_degrees(101) - Vec3(-9.126070596, 19.92319730, 149.2609617)).norm(), 2e-7);
  EXPECT_EQ(run.model().elements[0].set->log_line(run.model(), 0).substr(0, 40),
            "modal: 1 1 5.3 0.698113 0.00943396 0.071");
}

TEST(ModalDecks, GenericBodyWithSecondOrderInertia) {
  ModalDeck deck = generic_deck(turned(1.1), Vec3::Zero());
  deck.joints.replace(deck.joints.rfind(';'), 1, ", use invariant 9;");
  ModalRun run(deck);
  expect_generic(run, {{.02, -1.333370458e-02, 7.368280419e-03, 4.212747642e-02, 5.152213174e-03,
                        8.729557179e-03, -1.654682050e-03, 3.153972376, -6.847644822, 12.24093937},
                       {.1, -2.049436625e-02, 1.071886267e-02, 4.664350694e-02, 1.075206539e-01,
                        4.500983330e-01, -1.442929229e-02, 8.117294014, -3.647762104, 8.717986637},
                       {.2, -4.901452795e-02, 1.040730427e-02, 6.643303468e-02, -1.517791268e-01,
                        1.688548772, 2.440937923e-01, 4.488576776, -0.3249096006, 12.03810877}});
}

ModalDeck loaded_deck(const Vec3& o = Vec3::Zero()) {
  ModalDeck deck = generic_deck(turned(1.1), Vec3::Zero(), o);
  deck.forces = kLoads;
  return deck;
}
const std::string kGravity = "gravity: uniform, component, const, 0., const, 1., const, -9.;\n";

TEST(ModalDecks, GenericBodyWithGravityAndLoads) {
  ModalDeck deck = loaded_deck();
  deck.others = kGravity;
  ModalRun run(deck);
  expect_generic(run, {{.02, -1.413795082e-02, 7.828624734e-03, 4.220902839e-02, 5.074007495e-03,
                        8.974326375e-03, -3.293984657e-03, 3.192405844, -6.858062036, 12.20500183},
                       {.1, 2.374499407e-04, 9.317033178e-03, 4.239072927e-02, 1.070323335e-01,
                        4.559134597e-01, -6.090304443e-02, 8.172152726, -3.927842214, 8.754221217},
                       {.2, -4.440319251e-02, 9.268072886e-03, 6.501472716e-02, -1.441416061e-01,
                        1.706071375, 5.522064806e-02, 4.847893982, -0.3616448651, 10.46281227}});
  EXPECT_LT((run.force(3) - Vec3(0.5346860564, -0.6633655802, -7.019548200)).norm(), 2e-8);
  EXPECT_LT((run.couple(3) - Vec3(-.3, -.2, .5)).norm(), 1e-9);
  EXPECT_LT((run.node(101).x - Vec3(-1.527922939, 1.512184476, 0.6809689328)).norm(), 2e-9);
  EXPECT_LT((run.euler_degrees(101) - Vec3(32.90105875, 20.39837124, 172.2052278)).norm(), 2e-7);
}

/// A modal force of 0 and loads given through the joint's own resultant change nothing.
TEST(ModalDecks, InterfaceOffsetAndASecondInterface) {
  const Vec3 o(.1, .2, -.3);
  ModalDeck deck = loaded_deck(o);
  const Vec3 w(3, -5, 12), place = turned(1.1) * Vec3(.5, .1, 0);
  deck.node(102, "static", {place, turned(1.1), w.cross(place), w});
  deck.joints.replace(deck.joints.rfind("1, \"tip\""), 8, "2, \"2\", 102, null, \"tip\"");
  ModalRun run(deck);
  ASSERT_TRUE(run.ready());
  run.to(.2);
  EXPECT_LT(
      (Vec3(run.q(1), run.q(2), run.q(3)) - Vec3(-0.04176123944, 0.009901189742, 0.06626798952))
          .norm(),
      1e-9);
  EXPECT_LT((run.node(101).x - Vec3(-1.3120052, 1.520681, 1.15232182)).norm(), 2e-7);
  EXPECT_LT((run.force(3, 1) - Vec3(0.62809534, -0.75091703, -7.00297222)).norm(), 2e-7);
  EXPECT_LT((run.couple(3, 1) - Vec3(-.5, -1.6, -.5)).norm(), 1e-7);
}

FemData body_with_start() {
  FemData data = generic_body();
  data.initial_amplitudes << .05, -.03, .02;
  data.initial_velocities << 1, -2, 3;
  return data;
}

TEST(ModalDecks, ClampedWithTwoInterfacesAndStartValues) {
  const FemData data = body_with_start();
  const VecX q0 = data.initial_amplitudes, p0 = data.initial_velocities;
  const Mat3 R = turned(.9);
  const Vec3 x(.1, .2, .3);
  ModalDeck deck;
  deck.h = 2e-3;
  deck.skip_assembly = true;
  deck.initial_value = "derivatives tolerance: 1e12;";
  deck.files = {{"body.fem", fem(data)}};
  for (const auto& [label, fem_node] : {std::pair{101, 3}, {102, 1}}) {
    const MatX U = data.shapes.middleRows(6 * fem_node, 3),
               V = data.shapes.middleRows(6 * fem_node + 3, 3);
    const Vec3 s = V * q0;
    deck.node(label, "static",
              {x + R * (Vec3(data.positions.col(fem_node)) + U * q0),
               R * rotation_of_vector<double>(std::atan(s.norm()) / s.norm() * s), R * (U * p0),
               R * (V * p0)});
  }
  deck.joints = "joint: 1, modal, clamped, position, " + digits(x) + ", orientation, " + digits(R) +
                ", 3, 4, no damping, \"body.fem\", 2, \"tip\", 101, null, 2, 102, null;\n";
  deck.forces = kLoads;
  deck.others = kGravity;
  ModalRun run(deck);
  ASSERT_TRUE(run.ready());
  run.to(.02);
  EXPECT_LT((Vec3(run.q(1), run.q(2), run.q(3)) -
             Vec3(6.456136292e-02, -6.676414509e-02, 6.566621661e-02))
                .norm(),
            1e-10);
  run.to(.2);
  EXPECT_LT((Vec3(run.q(1), run.q(2), run.q(3)) -
             Vec3(-1.225536402e-01, 5.245991742e-02, 9.332465657e-03))
                .norm(),
            1e-9);
  EXPECT_LT(
      (Vec3(run.p(1), run.p(2), run.p(3)) - Vec3(5.753645870e-01, 7.524647093e-01, -3.247670658))
          .norm(),
      2e-8);
  EXPECT_LT((run.node(101).x - Vec3(1.210543195, 1.145172105, -1.226674592e-01)).norm(), 1e-9);
  EXPECT_LT((run.euler_degrees(101) - Vec3(4.684534537, 29.34103501, 34.07072477)).norm(), 2e-7);
  EXPECT_LT((run.node(101).w - Vec3(-1.082586152, -2.398167466, 1.009071303)).norm(), 2e-8);
  EXPECT_LT((run.force(3) - Vec3(-6.569692135, 1.794124995, -1.902698282)).norm(), 1e-7);
  EXPECT_LT((run.node(102).x - Vec3(3.809034118e-01, 6.041319534e-01, 1.693403535e-01)).norm(),
            1e-9);
}

/// The initial assembly relaxes amplitudes to -K⁻¹ C p0 and keeps velocities; skipping it keeps
/// both.
TEST(ModalDecks, InitialValuesAndAssembly) {
  struct Case {
    bool skip, damped;
    Vec3 q;
  };
  const Vec3 relaxed(-1.037512821e-02, 2.089168548e-02, -3.022904262e-02);
  for (const Case& c : {Case{false, false, Vec3::Zero()},
                        {true, false, Vec3(.05, -.03, .02)},
                        {false, true, relaxed}}) {
    FemData data = body_with_start();
    if (c.damped) data.damping = .01 * data.stiffness + .2 * data.mass;
    ModalDeck deck;
    deck.skip_assembly = c.skip;
    deck.initial_value = "derivatives tolerance: 1e12;";
    deck.files = {{"body.fem", fem(data)}};
    deck.joints = "joint: 1, modal, clamped, 3, 4, damping from file, \"body.fem\", 0;\n";
    ModalRun run(deck);
    ASSERT_TRUE(run.ready());
    EXPECT_LT((Vec3(run.q(1), run.q(2), run.q(3)) - c.q).norm(), 1e-9);
    EXPECT_LT((Vec3(run.p(1), run.p(2), run.p(3)) - Vec3(1, -2, 3)).norm(), 1e-12);
  }
}

/// The form with mode numbers, and the one without: a pair to each mode in turn.
TEST(ModalDecks, InitialValuesOfTheCard) {
  for (const auto& [card, q] : {std::pair{"mode, 3, .1, 4., mode, 1, .2, 5.", Vec3(.2, 0, .1)},
                                {".2, 5., 0., 0., .1, 4.", Vec3(.2, 0, .1)}}) {
    ModalDeck deck;
    deck.skip_assembly = true;
    deck.initial_value = "derivatives tolerance: 1e12;";
    deck.files = {{"body.fem", fem(body_with_start())}};
    deck.joints = "joint: 1, modal, clamped, 3, initial value, " + std::string(card) +
                  ", 4, no damping, \"body.fem\", 0;\n";
    ModalRun run(deck);
    ASSERT_TRUE(run.ready());
    EXPECT_EQ(Vec3(run.q(1), run.q(2), run.q(3)), q) << card;
    EXPECT_EQ(Vec3(run.p(1), run.p(2), run.p(3)), Vec3(5, 0, 4)) << card;
  }
}

/// A list keeps the mode numbers of the file; the first modes are taken without one.
TEST(ModalDecks, ModesOfAList) {
  ModalDeck deck = clamped(hand_made(true), "no damping");
  deck.joints = "joint: 1, modal, clamped, 1, list, 2, 3, no damping, \"body.fem\", 0;\n";
  ModalRun listed(deck);
  ASSERT_TRUE(listed.ready());
  listed.to(1);
  EXPECT_NEAR(listed.q(2), 5.738462164e-03, 1e-10);
  deck.joints = "joint: 1, modal, clamped, 1, 3, no damping, \"body.fem\", 0;\n";
  ModalRun first(deck);
  ASSERT_TRUE(first.ready());
  first.to(1);
  EXPECT_NEAR(first.q(1), -4.703853493, 1e-8);
}

/// The origin moves the floating frame, not the body: at another reference point the interface node
/// moves the same way.
TEST(ModalDecks, OriginOfTheFloatingFrame) {
  const auto end_position = [](const std::string& origin, const Vec3& at) {
    ModalDeck deck;
    deck.h = 1e-3;
    deck.initial_value = "derivatives tolerance: 1e-6; derivatives max iterations: 20;";
    deck.files = {{"body.fem", fem(generic_body())}};
    deck.node(1, "modal", {at});
    deck.node(101, "static", {kTip});
    deck.joints =
        "joint: 1, modal, 1, 3, 4, no damping, \"body.fem\", " + origin + "1, tip, 101, null;\n";
    deck.joints.replace(deck.joints.find("tip"), 3, "\"tip\"");
    deck.forces = kLoads;
    ModalRun run(deck);
    EXPECT_TRUE(run.ready());
    run.to(.1);
    return run.node(101).x;
  };
  const Vec3 plain = end_position("", Vec3::Zero());
  EXPECT_GT((plain - kTip).norm(), 1e-3);
  // The frame is carried by another FEM node: shapes do not vanish there, which is another frame of
  // the same motion only to first order; with the node that has no shapes it is the same to
  // round-off.
  EXPECT_LT((end_position("origin node, \"1\", ", Vec3::Zero()) - plain).norm(), 1e-12);
  const Vec3 o(.2, .3, -.1);
  EXPECT_LT((end_position("origin position, " + digits(o) + ", ", o) - plain).norm(),
            1e-7);  // the steps cut the two motions differently
}

/// Two modal joints on one node: twice the inertia, half the acceleration.
TEST(ModalDecks, TwoBodiesOnOneNode) {
  const auto height = [](int bodies) {
    ModalDeck deck;
    deck.files = {{"body.fem", fem(hand_made(false))}};
    deck.initial_value = "derivatives tolerance: 1e-6; derivatives max iterations: 20;";
    deck.node(1, "modal");
    for (int k = 1; k <= bodies; ++k)
      deck.joints +=
          "joint: " + std::to_string(k) + ", modal, 1, 2, 3, no damping, \"body.fem\", 0;\n";
    deck.forces = "force: 1, absolute, 1, position, null, 0.,0.,1., const, 3.;\n";
    ModalRun run(deck);
    EXPECT_TRUE(run.ready());
    run.to(1);
    return run.node(1).x.z();
  };
  EXPECT_NEAR(height(1), .5, 1e-6);
  EXPECT_NEAR(height(2), .25, 1e-6);
}

/// A force on a mode equals the load that has this modal component; its resultant is given by hand.
TEST(ModalDecks, ModalForces) {
  const auto amplitudes = [](const std::string& force, const std::string& more) {
    ModalDeck deck = clamped(hand_made(true), "no damping");
    deck.others.clear();
    deck.forces = force;
    deck.joints.replace(deck.joints.rfind("0;"), 2, more);
    if (more != "0;") deck.node(101, "static", {Vec3(0, 2, 0)});
    ModalRun run(deck);
    EXPECT_TRUE(run.ready());
    run.to(.5);
    return Vec3(run.q(1), run.q(2), 0);
  };
  const Vec3 modal = amplitudes("force: 1, modal, 1, list, 2, 1, 2, const, 3., const, 2.;\n", "0;");
  const Vec3 nodal = amplitudes("force: 1, absolute, 101, position, null, 2., 0., 3., const, 1.;\n",
                                "1, 1003, 101, null;");
  EXPECT_GT(nodal.norm(), .1);
  EXPECT_LT((modal - nodal).norm(), 1e-9);
  EXPECT_LT((amplitudes("force: 1, modal, 1, const, 3., const, 2.;\n", "0;") - nodal).norm(), 1e-9);
}

/// Behind the number of interface nodes `output` is theirs, even of none; the joint's own comes
/// last.
TEST(ModalDecks, OutputBehindTheInterfacesIsTheirs) {
  const auto is_written = [](const std::string& end) {
    ModalDeck deck;
    deck.control = "structural nodes: 1; joints: 1;";
    deck.files = {{"rigid.fem", fem(hand_made(false))}};
    deck.node(1, "modal");
    deck.joints = "joint: 1, modal, 1, 2, from file, no damping, \"rigid.fem\", 0" + end + ";\n";
    const ModalRun run(deck);
    const ElementRef joint = run.model().find_element(Family::joint, 1);
    return joint.set->info(joint.index).output;
  };
  EXPECT_TRUE(is_written(""));
  EXPECT_TRUE(is_written(", output, no"));
  EXPECT_FALSE(is_written(", output, yes, output, no"));
}

}  // namespace
}  // namespace mbcosim::modal_deck_test
