/// Eigenanalysis: closed forms, the reference solver's numbers, dense against sparse.
#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>

#include "deck_digits.h"
#include "deck_run.h"
#include "output/eigen_text.h"
#include "solver/eigenanalysis.h"

namespace mbcosim::eigen_test {
namespace {

using Complex = std::complex<double>;

std::string small_step(const std::string& more = "") {
  return initial_value_block(1e-3, 1,
                             "max iterations: 20; tolerance: 1e-9; derivatives tolerance: 1e-3; "
                             "derivatives coefficient: 1e-3; " +
                                 more);
}

/// Positive imaginary parts, increasing.
std::vector<double> frequencies(const Spectrum& s) {
  std::vector<double> w;
  for (const Complex& e : s.values)
    if (e.imag() > 1e-6) w.push_back(e.imag());
  std::sort(w.begin(), w.end());
  return w;
}

Spectrum all_modes(DeckRun& run) {
  auto spectrum = run.simulation().eigen();
  EXPECT_TRUE(spectrum) << spectrum.error().message;
  return std::move(*spectrum);
}

const char* const kSupportedBody = R"(
begin: control data; structural nodes: 2; rigid bodies: 1; joints: 2; end: control data;
begin: nodes;
  structural: 1, dynamic, 1.,0.,0., eye, null, null;
  structural: 2, static, null, eye, null, null;
end: nodes;
begin: elements;
  body: 1, 1, 2., null, eye;
  joint: 1, clamp, 2, node, node;
  joint: 2, deformable joint, 2, position, 1.,0.,0., 1, position, null, linear viscoelastic generic,
    diag, 800.,900.,1000.,100.,200.,300., diag, 8.,9.,10.,1.,2.,3.;
end: elements;
)";

// Of a velocity: m = 2, k = 800, c = 8 + 12. The card takes the force for a given one.
TEST(Eigenanalysis, FeedbackByDrivesBelongsToTheSystemAndNotToTheCard) {
  std::string deck = kSupportedBody;
  deck.replace(deck.find("joints: 2;"), 10, "joints: 2; forces: 1;");
  deck.replace(deck.find("end: elements"), 0,
               "force: 3, absolute, 1, position, null, 1.,0.,0., node, 1, structural, string, "
               "\"XP[1]\", linear, 0., -12.;\n");
  const auto nearest = [](const auto& values, Complex expected) {
    double distance = HUGE_VAL;
    for (const Complex value : values) distance = std::min(distance, std::abs(value - expected));
    return distance;
  };
  const Complex closed(-5, std::sqrt(375.)), open(-2, std::sqrt(396.));
  DeckRun run(small_step("eigenanalysis: 0., parameter, .01, use lapack;") + deck);
  ASSERT_TRUE(run.ready());
  const Spectrum spectrum = all_modes(run);
  EXPECT_LT(nearest(spectrum.values, closed), 1e-9);
  EXPECT_GT(nearest(spectrum.values, open), 1);
  for (const char* how : {"use lapack", "use arpack, 12, 40, 0."}) {
    DeckRun card(small_step(std::string("eigenanalysis: 0., parameter, .01, ") + how + ";") + deck);
    ASSERT_TRUE(card.ready());
    const auto report = analyse_modes(card.model(), card.simulation().state(),
                                      *card.model().initial_value.eigenanalysis);
    ASSERT_TRUE(report);
    std::vector<Complex> values;
    for (const int k : report->modes) values.push_back(report->eigenvalue(k));
    EXPECT_LT(nearest(values, open), 1e-6) << how;
    EXPECT_GT(nearest(values, closed), 1) << how;
  }
}

TEST(Eigenanalysis, ReferenceNumbersOfASupportedBody) {
  DeckRun run(small_step("eigenanalysis: 0., parameter, .01, output eigenvectors, use lapack;") +
              kSupportedBody);
  ASSERT_TRUE(run.ready());
  const auto report = analyse_modes(run.model(), run.simulation().state(),
                                    *run.model().initial_value.eigenanalysis);
  ASSERT_TRUE(report);
  EXPECT_EQ(report->modes.size(), 12u);
  EXPECT_EQ(report->solution.first, 6);
  EXPECT_EQ(report->solution.last, 17);
  EXPECT_DOUBLE_EQ(report->pencil.kappa, 0.005);
  for (const Complex expected :
       {Complex(-2, 19.8997), Complex(-2.25, 21.0935), Complex(-2.5, 22.2205),
        Complex(-.5, 9.98749), Complex(-1, 14.1067), Complex(-1.5, 17.2554)}) {
    double nearest = HUGE_VAL;
    for (const int k : report->modes)
      nearest = std::min(nearest, std::abs(report->eigenvalue(k) - expected));
    EXPECT_LT(nearest, 1e-4) << expected;
  }
  const MatX minus = run.model().dense(report->pencil.minus),
             plus = run.model().dense(report->pencil.plus);
  for (const int k : report->modes) {
    const Complex lambda = Complex(report->solution.alpha_r(k), report->solution.alpha_i(k)) /
                           report->solution.beta(k);
    EXPECT_LT(
        (minus * report->solution.right.col(k) - lambda * (plus * report->solution.right.col(k)))
            .norm(),
        1e-9);
    EXPECT_LT((report->solution.left.col(k).adjoint() * minus -
               lambda * (report->solution.left.col(k).adjoint() * plus))
                  .norm(),
              1e-9);
    const auto v = report->solution.right.col(k);
    EXPECT_NEAR((v.real().cwiseAbs() + v.imag().cwiseAbs()).maxCoeff(), 1, 1e-12);
  }
}

TEST(Eigenanalysis, WritesTheFilesOfTheCard) {
  DeckRun run(small_step("eigenanalysis: list, 11, 0., 1., 2., 3., 4., 5., 6., 7., 8., 9., 10., "
                         "parameter, .01, output sparse matrices, "
                         "output eigenvectors, output geometry, lower frequency limit, 2., upper "
                         "frequency limit, 3., "
                         "results output precision, 3;") +
              kSupportedBody);
  ASSERT_TRUE(run.ready());
  auto report = analyse_modes(run.model(), run.simulation().state(),
                              *run.model().initial_value.eigenanalysis);
  ASSERT_TRUE(report);
  EXPECT_EQ(eigen_suffix(report->settings, 3), "_03");
  const std::string file = eigen_file(*report, run.model());
  EXPECT_THAT(file, testing::HasSubstr("dCoef = 5.000e-03;"));
  EXPECT_THAT(file, testing::HasSubstr("];\nAplus = spconvert(Aplus);\n"));
  EXPECT_THAT(file, testing::HasSubstr("labels = [\n1;\n2;\n];"));
  EXPECT_THAT(file, testing::HasSubstr("idx = [\n0;\n12;\n];"));
  EXPECT_THAT(file, testing::HasSubstr("VL = ["));
  EXPECT_EQ(report->modes.size(), 2u);  // 2.245 and 2.746 Hz without their conjugates
  for (const int k : report->modes) EXPECT_GT(report->eigenvalue(k).imag(), 0);
  EXPECT_THAT(eigen_table(*report, 6), testing::HasSubstr("ILO=7 IHI=18"));
  EXPECT_THAT(eigen_table(*report, 6), testing::HasSubstr("2.74629"));
}

/// Three springs and dampers c of a point mass 1.5 kg, and one with c = 100 of an abstract
/// oscillator of mass 2, whose modes are real.
std::string small_system(const std::string& card) {
  return initial_value_block(
             1e-2, .01,
             "max iterations: 30; tolerance: 1e-6; derivatives tolerance: 1e-4; " + card) +
         R"(
begin: control data; structural nodes: 1; abstract nodes: 1; rigid bodies: 1; genels: 5; end: control data;
begin: nodes; structural: 1, dynamic displacement, 1.,2.,0., null; abstract: 1, differential; end: nodes;
begin: elements; body: 1, 1, 1.5;
 genel: 1, spring support, 1, structural, 1, algebraic, linear viscoelastic, 100., 1.;
 genel: 2, spring support, 1, structural, 2, algebraic, linear viscoelastic, 150., 1.;
 genel: 3, spring support, 1, structural, 3, algebraic, linear viscoelastic, 270., 1.;
 genel: 4, spring support, 1, abstract, algebraic, linear viscoelastic, 100., 100.;
 genel: 5, mass, 1, abstract, algebraic, 2.;
end: elements;
)";
}

/// Table and file of its modes at the start.
std::pair<std::string, std::string> texts_of(const std::string& card, int digits = 6) {
  DeckRun run(small_system(card));
  if (!run.ready()) return {};
  const auto report = analyse_modes(run.model(), run.simulation().state(),
                                    *run.model().initial_value.eigenanalysis);
  EXPECT_TRUE(report);
  return {eigen_table(*report, digits), eigen_file(*report, run.model())};
}

/// Lines of the reference solver.
TEST(Eigenanalysis, TextsAreLaidOutAsThoseOfTheReference) {
  const auto [table, file] = texts_of(
      "eigenanalysis: 0., parameter, .01, output full matrices, output eigenvectors, matrix output "
      "precision, 2;");
  EXPECT_THAT(table, testing::StartsWith(
                         "Info: 0, success BALANC=\"P\" ILO=1 IHI=8 ABNRM=100.5 "
                         "BBNRM=101.5\n"
                         "Mode n.       Real           Imag             Damp %     Freq Hz\n"
                         "       1:    -0.333333 +      8.15816 j         4.08248         "
                         "1.29841\n"));
  EXPECT_THAT(file, testing::StartsWith(
                        "% time: 0.000000e+00\ndTime = 0.000000e+00;\n% coefficient\n"
                        "dCoef = 5.000000e-03;\n% F/xPrime + dCoef * F/x\n"
                        "Aplus = [1.50e+00 0.00e+00 0.00e+00 -5.00e-03 0.00e+00 0.00e+00 0.00e+00 "
                        "0.00e+00 ;\n"));
  EXPECT_THAT(file, testing::HasSubstr(" ];\n% F/xPrime - dCoef * F/x\nAminus = [1.50e+00 "));
  EXPECT_THAT(file, testing::HasSubstr("];\n% alphar, alphai, beta\nalpha = [9.99"));
  // Of the first row of the abstract oscillator: six complex modes, two real ones.
  EXPECT_THAT(file,
              testing::HasSubstr("0.000000e+00-i*0.000000e+00 -9.795832e-01 -2.041685e-02 ;\n"));
}

TEST(Eigenanalysis, FollowsTheDigitsOfAllResults) {
  const std::string table = texts_of("eigenanalysis: 0., parameter, .01;", 10).first;
  EXPECT_THAT(table, testing::HasSubstr("       1: -0.3333333333 +  8.158"));
}

TEST(Eigenanalysis, SparseMatricesAloneNeedNoModes) {
  const auto [table, file] = texts_of("eigenanalysis: 0., parameter, .01, output sparse matrices;");
  EXPECT_EQ(table, "");
  EXPECT_THAT(file, testing::HasSubstr("% F/xPrime + dCoef *F/x\nAplus = [1 1 1.500000e+00;\n4 1 "
                                       "1.500000e+00;\n"));
  EXPECT_THAT(file, testing::EndsWith("8 8 -5.000000e-03;\n];\nAminus = spconvert(Aminus);\n"));
}

TEST(Eigenanalysis, BalancesAsTheReference) {
  EXPECT_THAT(texts_of("eigenanalysis: 0., balance, no;").first,
              testing::HasSubstr("BALANC=\"N\" ILO=1 IHI=8 ABNRM=-1 BBNRM=-1\n"));
  EXPECT_THAT(texts_of("eigenanalysis: 0., balance, scale;").first,
              testing::HasSubstr("BALANC=\"B\""));
}

TEST(Eigenanalysis, IterativeSolverFindsTheModesNearItsParameter) {
  DeckRun run(small_step("eigenanalysis: 0., parameter, .1, use arpack, 4, 12, 1e-10;") +
              kSupportedBody);
  ASSERT_TRUE(run.ready());
  const auto report = analyse_modes(run.model(), run.simulation().state(),
                                    *run.model().initial_value.eigenanalysis);
  ASSERT_TRUE(report) << report.error().message;
  ASSERT_EQ(report->modes.size(), 4u);
  for (const Complex expected :
       {Complex(-.5, 9.98749), Complex(-1, 14.1067), Complex(-1, -14.1067)}) {
    double nearest = HUGE_VAL;
    for (const int k : report->modes)
      nearest = std::min(nearest, std::abs(report->eigenvalue(k) - expected));
    EXPECT_LT(nearest, 1e-4) << expected;
  }
}

TEST(Eigenanalysis, RefusesOddFormats) {
  for (const char* bad : {"%s", "%n%d", "../%d", "%d%d", "%", "%1000d", "%-d"}) {
    const LoadReport report =
        load_deck(BundleSource({{"deck.mbd", small_step("eigenanalysis: 0., suffix format, \"" +
                                                        std::string(bad) + "\";") +
                                                 kSupportedBody}}),
                  "deck.mbd");
    EXPECT_FALSE(report.ok()) << bad;
  }
}

/// Pendulum on a revolute pin about y: ω² = m g L / (J + m L²).
std::string pendulum(const std::string& gravity) {
  return small_step() + R"(
begin: control data; structural nodes: 1; rigid bodies: 1; joints: 1; gravity; end: control data;
begin: nodes; structural: 1, dynamic, null, eye, null, null; end: nodes;
begin: elements;
  body: 1, 1, 1.3, 0.,0.,-.5, diag, .01,.02,.03;
  joint: 1, revolute pin, 1, null, hinge, 1, 1.,0.,0., 3, 0.,1.,0., null, hinge, 1, 1.,0.,0., 3, 0.,1.,0.;
  gravity: uniform, 0.,0.,)" +
         gravity + R"(, const, 9.81;
end: elements;
)";
}

TEST(Spectrum, PendulumHasItsFrequencyAndNothingElse) {
  DeckRun run(pendulum("-1."));
  ASSERT_TRUE(run.ready());
  const Spectrum s = all_modes(run);
  ASSERT_EQ(s.values.size(), 2);
  EXPECT_NEAR(std::abs(s.values(0).imag()), std::sqrt(1.3 * 9.81 * .5 / (.02 + 1.3 * .25)), 1e-6);
  EXPECT_NEAR(s.values(0).real(), 0, 1e-6);
}

TEST(Spectrum, UprightPendulumIsUnstable) {
  DeckRun run(pendulum("1."));
  ASSERT_TRUE(run.ready());
  const Spectrum s = all_modes(run);
  ASSERT_EQ(s.values.size(), 2);
  const double rate = std::sqrt(1.3 * 9.81 * .5 / (.02 + 1.3 * .25));
  EXPECT_NEAR(std::max(s.values(0).real(), s.values(1).real()), rate, 1e-6);
  EXPECT_NEAR(std::min(s.values(0).real(), s.values(1).real()), -rate, 1e-6);
}

TEST(Spectrum, EigenvectorsSolveTheDescriptorSystem) {
  DeckRun run(small_step() + kSupportedBody);
  ASSERT_TRUE(run.ready());
  const Linearization l = run.simulation().linearize();
  const MatX e = run.model().dense(l.e), a = run.model().dense(l.a);
  const Spectrum s = all_modes(run);
  ASSERT_EQ(s.values.size(), 12);
  for (int k = 0; k < 12; ++k)
    EXPECT_LT((a * s.vectors.col(k) - s.values(k) * (e * s.vectors.col(k))).norm(),
              1e-7 * std::abs(s.values(k)));
}

/// Cantilever of `elements` three-node beams along x, lumped bodies as usual: every node carries
/// the mass of half a spacing on each side.
std::string cantilever(int elements) {
  const int nodes = 2 * elements + 1;
  const double piece = 1.0 / (2 * elements);  // distance of nodes; L = 1 m, m = 1 kg/m
  std::string deck =
      small_step() + "begin: control data; structural nodes: " + std::to_string(nodes) +
      "; rigid bodies: " + std::to_string(nodes - 1) + "; beams: " + std::to_string(elements) +
      "; joints: 1; end: control data;\nbegin: nodes;\n";
  for (int k = 0; k < nodes; ++k)
    deck += "structural: " + std::to_string(k) + (k == 0 ? ", static, " : ", dynamic, ") +
            digits(k * piece) + ",0.,0., eye, null, null;\n";
  deck += "end: nodes;\nbegin: elements;\njoint: 1, clamp, 0, node, node;\n";
  for (int k = 1; k < nodes; ++k) {
    const double m = k == nodes - 1 ? piece / 2 : piece, x = k == nodes - 1 ? -piece / 4 : 0;
    const double j = m * std::pow(k == nodes - 1 ? piece / 2 : piece, 2) / 12;
    deck += "body: " + std::to_string(k) + ", " + std::to_string(k) + ", " + digits(m) + ", " +
            digits(x) + ",0.,0., diag, 1e-3," + digits(j) + "," + digits(j) + ";\n";
  }
  for (int k = 0; k < elements; ++k) {
    deck += "beam3: " + std::to_string(k);
    for (int n = 0; n < 3; ++n) deck += ", " + std::to_string(2 * k + n) + ", null";
    deck += ", eye, linear elastic generic, diag, 1e8, 1e8, 1e8, 1e4, 100., 400., same, same;\n";
  }
  return deck + "end: elements;\n";
}

TEST(Spectrum, CantileverConvergesToTheBernoulliBeam) {
  // ω = (1.8751)² sqrt(EI/(m L⁴)); EI = 100 N·m² and 400 N·m² in the two planes.
  const double exact = 1.875104068711961 * 1.875104068711961 * 10;
  std::vector<double> errors;
  for (const int elements : {2, 4, 8}) {
    DeckRun run(cantilever(elements));
    ASSERT_TRUE(run.ready());
    const std::vector<double> w = frequencies(all_modes(run));
    ASSERT_GT(w.size(), 2u);
    errors.push_back(std::abs(w[0] / exact - 1));
    EXPECT_NEAR(w[1] / w[0], 2, 0.02);
  }
  EXPECT_LT(errors[2], 1e-3);
  EXPECT_GT(errors[0] / errors[1], 3);
  EXPECT_GT(errors[1] / errors[2], 3);
}

TEST(Spectrum, SparseAgreesWithDense) {
  DeckRun run(cantilever(6));
  ASSERT_TRUE(run.ready());
  const Linearization l = run.simulation().linearize();
  const auto dense = finite_spectrum(l);
  ASSERT_TRUE(dense);
  for (const Complex shift : {Complex(1e-2, 0), Complex(1e-2, 220)}) {
    const auto sparse = spectrum_near(l, shift, 6);
    ASSERT_TRUE(sparse) << sparse.error().message;
    ASSERT_EQ(sparse->values.size(), 6);
    std::vector<double> distances;
    for (const Complex& s : dense->values) distances.push_back(std::abs(s - shift));
    std::sort(distances.begin(), distances.end());
    for (int k = 0; k < 6; ++k) {
      double nearest = HUGE_VAL;
      for (const Complex& s : dense->values)
        nearest = std::min(nearest, std::abs(s - sparse->values(k)));
      EXPECT_LT(nearest, 1e-5) << sparse->values(k);
      EXPECT_LT(std::abs(sparse->values(k) - shift), distances[5] * (1 + 1e-6));
    }
  }
}

TEST(Spectrum, LargeBeamByTheSparseWay) {
  DeckRun run(cantilever(60));
  ASSERT_TRUE(run.ready());
  const auto near = run.simulation().eigen(4);
  ASSERT_TRUE(near) << near.error().message;
  ASSERT_EQ(near->values.size(), 4);
  const double exact = 1.875104068711961 * 1.875104068711961 * 10;
  EXPECT_NEAR(std::abs(near->values(0).imag()) / exact, 1, 1e-4);
  EXPECT_NEAR(std::abs(near->values(2).imag()) / (2 * exact), 1, 1e-3);
}

TEST(Spectrum, FreeBodyHasTwelveZeros) {
  DeckRun run(small_step() + R"(
begin: control data; structural nodes: 1; rigid bodies: 1; end: control data;
begin: nodes; structural: 1, dynamic, null, eye, null, null; end: nodes;
begin: elements; body: 1, 1, 1., null, eye; end: elements;
)");
  ASSERT_TRUE(run.ready());
  const Spectrum free_body = all_modes(run);
  EXPECT_EQ(free_body.values.size(), 12);
  for (const Complex& s : free_body.values) EXPECT_LT(std::abs(s), 1e-5);
}

}  // namespace
}  // namespace mbcosim::eigen_test
