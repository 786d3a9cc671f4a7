#include "reduction/reduce.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>

#include "fe_models.h"
#include "reduction/basis.h"
#include "reduction/job.h"
#include "reduction/structure.h"

namespace mbcosim::reduce_test {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

constexpr double kTwoPi = 2 * std::numbers::pi;

/// Options for a basis with consistent mass.
ReductionOptions options_of(ReductionBasis basis, int modes,
                            std::vector<std::string> interface_nodes = {}) {
  ReductionOptions o;
  o.basis = basis;
  o.modes = modes;
  o.interface_nodes = std::move(interface_nodes);
  o.inertia = ReductionInertia::rigid;
  return o;
}

Reduction reduced(const FeModel& model, const ReductionOptions& options) {
  auto r = reduce(model, options);
  if (!r) throw std::runtime_error(r.error().message);
  return std::move(*r);
}

std::string refusal(const FeModel& model, const ReductionOptions& options) {
  const auto r = reduce(model, options);
  return r ? "accepted" : r.error().message;
}

/// Angular frequencies of the reduced body against `expected`.
void expect_omegas(const Reduction& r, const std::vector<double>& expected, double tolerance) {
  ASSERT_GE(r.report.frequencies.size(), expected.size());
  for (std::size_t k = 0; k < expected.size(); ++k)
    EXPECT_NEAR(kTwoPi * r.report.frequencies[k] / expected[k], 1, tolerance) << "mode " << k + 1;
}

FeModel clamped(FeModel model, const std::string& label) {
  for (const int row : model.rows_of(model.node(label))) model.supported[row] = 1;
  return model;
}

// ------------------------------------------------------------------------------------------------
// chains: closed forms

TEST(ReduceChain, FreeModes) {
  const Reduction r = reduced(spring_chain(5), options_of(ReductionBasis::free_modes, 4));
  EXPECT_EQ(r.report.rigid_motions, 1);
  expect_omegas(r, {6.180339887, 11.75570505, 16.18033989, 19.02113033}, 1e-9);
}

TEST(ReduceChain, ConstrainedModes) {
  const Reduction r =
      reduced(clamped(spring_chain(5), "1"), options_of(ReductionBasis::constrained_modes, 4));
  expect_omegas(r, {3.472963553, 10, 15.32088886, 18.79385242}, 1e-9);
}

TEST(ReduceChain, CraigBamptonConvergesFromAbove) {
  const FeModel chain = spring_chain(5, 100);
  const std::vector<std::vector<double>> known = {
      {2.961240237, 9.551494975},
      {2.848105152, 8.636653469, 13.62583791},
      {2.846733147, 8.308494525, 13.26731315, 16.88817266},
      {2.846296766, 8.308300260, 13.09721468, 16.82507066, 19.18985947}};
  for (int n = 0; n < 4; ++n)
    expect_omegas(reduced(chain, options_of(ReductionBasis::craig_bampton, n, {"1", "5"})),
                  known[n], 1e-9);
}

TEST(ReduceChain, ComplementShapesAreTheFlexibility) {
  ReductionOptions o = options_of(ReductionBasis::complement, 0, {"1", "5"});
  o.diagonalize = false;
  const Reduction r = reduced(spring_chain(5, 100), o);
  for (int n = 0; n < 5; ++n) {
    EXPECT_NEAR(r.data.shapes(6 * n, 0), 0.01, 1e-14);
    EXPECT_NEAR(r.data.shapes(6 * n, 1), 0.01 * (n + 1), 1e-14);
  }
  EXPECT_LT(r.report.static_error, 1e-12);
  expect_omegas(reduced(spring_chain(5, 100), options_of(ReductionBasis::complement, 2, {"5"})),
                {2.846296766, 8.308300260, 13.91455950}, 1e-9);
}

TEST(ReduceChain, ReliefAndDecoupling) {
  ReductionOptions o = options_of(ReductionBasis::inertia_decoupling, 0, {"1", "5"});
  o.diagonalize = false;
  const Reduction r = reduced(spring_chain(5), o);
  const double column[] = {.012, .004, -.002, -.006, -.008};
  for (int n = 0; n < 5; ++n) {
    EXPECT_NEAR(r.data.shapes(6 * n, 0), column[n], 1e-14);
    EXPECT_NEAR(r.data.shapes(6 * n, 1), column[4 - n], 1e-14);
  }
  for (const auto basis : {ReductionBasis::inertia_relief, ReductionBasis::inertia_decoupling})
    expect_omegas(reduced(spring_chain(5), options_of(basis, 0, {"1", "5"})),
                  {6.324555320, 11.95228609}, 1e-9);
}

// ------------------------------------------------------------------------------------------------
// beams and plates: known frequencies

TEST(ReduceBeam, PlanarCantileverAndFree) {
  const std::vector<std::pair<int, std::vector<double>>> cantilevers = {
      {4, {3.5161302706, 22.060166308, 62.174892526}},
      {10, {3.5160182751, 22.035220870, 61.712922975}},
      {20, {3.5160154528, 22.034537783, 61.698224323}}};
  for (const auto& [elements, omegas] : cantilevers)
    expect_omegas(reduced(clamped(planar_beam(elements), "1"),
                          options_of(ReductionBasis::constrained_modes, 3)),
                  omegas, 1e-8);  // the spectrum spans 1e7
  expect_omegas(reduced(planar_beam(20), options_of(ReductionBasis::free_modes, 2)),
                {22.373333670, 61.673825465}, 1e-9);
}

TEST(ReduceBeam, SpaceBeamInAllBases) {
  const FeModel beam = space_beam();
  const auto omegas = [&](const FeModel& model, ReductionOptions o,
                          const std::vector<double>& known) {
    o.inertia = ReductionInertia::lumped;
    const Reduction r = reduced(model, o);
    expect_omegas(r, known, 2e-9);
    return r.report;
  };
  omegas(beam, options_of(ReductionBasis::free_modes, 6),
         {43.19176580, 52.89889365, 98.70876272, 114.4368738, 140.1559743, 193.6242031});
  ReductionOptions attached = options_of(ReductionBasis::constrained_modes, 6);
  attached.frame = ReductionFrame::node;
  attached.frame_node = "1";
  omegas(beam, attached,
         {7.119396478, 8.719444324, 43.62055183, 49.59318611, 53.42404715, 119.3320639});
  attached = options_of(ReductionBasis::craig_bampton, 4, {"9"});
  attached.frame = ReductionFrame::node;
  attached.frame_node = "1";
  omegas(beam, attached,
         {7.119795307, 8.722369232, 43.65565512, 49.79304885, 53.57937952, 119.4436728});
  EXPECT_LT(reduced(beam, attached).report.static_error, 1e-9);
  const ReductionReport both =
      omegas(beam, options_of(ReductionBasis::craig_bampton, 4, {"1", "9"}),
             {43.30258341, 53.03461695, 107.8719780, 114.6045129});
  EXPECT_EQ(both.removed_shapes, 6);
  EXPECT_GT(both.static_error, 0.1);  // inertia loads the inside, which four modes carry in part
  attached = options_of(ReductionBasis::complement, 4, {"9"});
  attached.interface_components["9"] = "23";
  attached.frame = ReductionFrame::node;
  attached.frame_node = "1";
  omegas(beam, attached,
         {7.119396478, 8.719444324, 43.62055183, 49.59318611, 56.64654879, 130.2785504});
  ReductionOptions ends = options_of(ReductionBasis::inertia_decoupling, 4, {"1", "9"});
  ends.interface_components = {{"1", "23"}, {"9", "23"}};
  omegas(beam, ends,
         {43.19176580, 52.89889365, 98.70876272, 114.4368738, 143.6485617, 222.0448285, 271.9482650,
          353.0358811});
}

TEST(ReduceBeam, RigidInertiaAndMeanAxes) {
  ReductionOptions o = options_of(ReductionBasis::inertia_decoupling, 2, {"9"});
  o.interface_components["9"] = "3";
  o.inertia = ReductionInertia::both;
  o.diagonalize = false;
  const Reduction r = reduced(space_beam(), o);
  EXPECT_NEAR(r.data.rigid->mass, 3, 1e-12);
  EXPECT_NEAR(
      (r.data.rigid->inertia - Vec3(0.04, 1.036057692, 1.036057692).asDiagonal().toDenseMatrix())
          .norm(),
      0, 1e-8);
  EXPECT_NEAR(r.data.shapes(6 * 8 + 2, 0), 7.287352961e-4, 1e-12);
  EXPECT_NEAR(r.data.shapes(6 * 4 + 2, 0), -3.792317708e-4, 1e-12);
  EXPECT_NEAR(r.data.shapes(2, 0), 5.700928289e-4, 1e-12);
  const MatX& lumped = *r.data.lumped;
  for (int j = 0; j < r.data.mode_count(); ++j) {  // Inv3 = Inv4 = 0
    Vec3 momentum = Vec3::Zero(), moment = Vec3::Zero();
    for (int n = 0; n < 9; ++n) {
      const Vec3 u = r.data.shapes.block<3, 1>(6 * n, j),
                 v = r.data.shapes.block<3, 1>(6 * n + 3, j);
      momentum += lumped(0, n) * u;
      moment += lumped(0, n) * Vec3(r.data.positions.col(n)).cross(u) +
                Vec3(lumped.block<3, 1>(3, n)).cwiseProduct(v);
    }
    EXPECT_LT(momentum.norm(), 1e-12);
    EXPECT_LT(moment.norm(), 1e-12);
  }
}

// Length and mass 1, with rows uy and rz only: no mass in the other directions.
TEST(ReduceBeam, CentreAndInertiaOfAPlanarModelAreThoseOfItsRows) {
  FeModel beam = planar_beam(10);
  beam.positions.row(0).array() += 9;
  ReductionOptions o = options_of(ReductionBasis::free_modes, 2);
  const Reduction r = reduced(beam, o);
  EXPECT_THAT(r.report.warnings, testing::Contains(HasSubstr("not the same in all directions")));
  EXPECT_NEAR(r.data.rigid->mass, 1, 1e-12);
  EXPECT_NEAR((r.data.positions.col(0) - Vec3(-0.5, 0, 0)).norm(), 0, 1e-10);
  EXPECT_NEAR(r.report.inertia.center.norm(), 0, 1e-10);
  EXPECT_NEAR((r.data.rigid->inertia - Vec3(0, 0, 1. / 12).asDiagonal().toDenseMatrix()).norm(), 0,
              1e-10);
}

TEST(ReducePlate, SimplySupported) {
  const double a = 1.5, b = 1;
  const Reduction r =
      reduced(plate(a, b, 24, 16, true), options_of(ReductionBasis::constrained_modes, 4));
  std::vector<double> exact;
  for (int m = 1; m < 4; ++m)
    for (int n = 1; n < 4; ++n)
      exact.push_back(std::pow(std::numbers::pi, 2) * (m * m / (a * a) + n * n / (b * b)));
  std::sort(exact.begin(), exact.end());
  exact.resize(4);
  expect_omegas(r, exact, 5e-3);  // the element converges from below with the square of its size
  for (int k = 0; k < 4; ++k) EXPECT_LT(kTwoPi * r.report.frequencies[k], exact[k]);
}

TEST(ReducePlate, LanczosFindsDoubleModes) {  // a square plate has pairs of equal frequencies
  const FeModel square = plate(1, 1, 12, 12, true);
  Structure structure(square, square.supported);
  const NormalModes modes = structure.modes(8, {}, {});
  ASSERT_GT(structure.size(), 400);
  EXPECT_NEAR(modes.squares(1) / modes.squares(2), 1, 1e-9);
  EXPECT_NEAR(modes.squares(6) / modes.squares(7), 1, 1e-9);
  EXPECT_EQ(structure.count_modes_below(1.001 * modes.squares(7)), 8);
  EXPECT_LT(modes.residual, 1e-8);
  const MatX gram = modes.shapes.transpose() * (structure.mass() * modes.shapes);
  EXPECT_LT((gram - MatX::Identity(8, 8)).norm(), 1e-8);
}

/// Also where the mass couples rows that the stiffness does not.
TEST(Structure, ShiftedMatricesHaveTheEntriesOfBoth) {
  const FeModel square = plate(1, 1, 5, 4, true);
  FeModel coupled = square;
  const int last = coupled.rows() - 1;
  coupled.mass.coeffRef(0, last) = coupled.mass.coeffRef(last, 0) = 1e-3;
  for (const FeModel* model : std::initializer_list<const FeModel*>{&square, &coupled}) {
    std::vector<char> held(model->rows(), 0);
    held[3] = held[7] = 1;
    const Structure structure(*model, held);
    const double sigma = 250;
    const MatX expected = MatX(structure.stiffness()) - sigma * MatX(structure.mass());
    EXPECT_LT((MatX(structure.shifted(sigma)) - expected).norm(), 1e-14 * expected.norm());
  }
}

/// K − σ M is regular for a body that can move, too; the modes are the same.
TEST(ReducePlate, ShiftedEigensolutionFindsTheSameModes) {
  for (const bool supported : {true, false}) {
    const FeModel square = plate(1, 1, 12, 12, supported);
    Structure plain(square, square.supported), shifted(square, square.supported);
    const NormalModes expected = plain.modes(6, {}, {});
    for (const double share : {-1e-2, -1.0}) {
      const NormalModes modes = shifted.modes(6, {1e-10, share * expected.squares(0)}, {});
      EXPECT_LT(
          (modes.squares - expected.squares).cwiseAbs().cwiseQuotient(expected.squares).maxCoeff(),
          1e-9);
      EXPECT_LT((shifted.rigid().transpose() * (shifted.mass() * modes.shapes)).norm(), 1e-9);
    }
    const NormalModes rough = shifted.modes(6, {1e-4, 0}, {});
    EXPECT_LT(
        (rough.squares - expected.squares).cwiseAbs().cwiseQuotient(expected.squares).maxCoeff(),
        1e-4);
  }
}

TEST(ReducePlate, FreePlateHasThreeRigidMotionsOutOfPlane) {
  const Reduction r =
      reduced(plate(1, 1, 12, 12, false), options_of(ReductionBasis::free_modes, 3));
  EXPECT_EQ(r.report.rigid_motions, 3);
  // Leissa: ω a² √(ρh/D) = 13.489, 19.789, 24.432 for ν = 0.3
  expect_omegas(r, {13.468, 19.596, 24.270}, 1e-2);
}

/// P f is in balance and P is a projection; Pᵀ x has no rigid content; K x = P f for the relieved
/// shapes x.
TEST(ReduceProjections, HoldToRoundOff) {
  const FeModel beam = space_beam();
  Structure body(beam, beam.supported);
  ASSERT_EQ(body.rigid_count(), 6);
  const MatX loads = MatX::Identity(body.size(), body.size());
  const MatX balanced = body.balanced(loads);
  EXPECT_LT((body.rigid().transpose() * balanced).cwiseAbs().maxCoeff(), 1e-14);
  EXPECT_LT((body.balanced(balanced) - balanced).cwiseAbs().maxCoeff(), 1e-14);
  const MatX relieved = body.solve(balanced);
  EXPECT_LT((body.stiffness() * relieved - balanced).cwiseAbs().maxCoeff(),
            1e-9);  // stiffness up to 1e6
  const MatX decoupled = body.without_rigid(relieved);
  EXPECT_LT((body.rigid().transpose() * (body.mass() * decoupled)).cwiseAbs().maxCoeff(),
            1e-14 * relieved.cwiseAbs().maxCoeff());
  EXPECT_LT((body.without_rigid(decoupled) - decoupled).cwiseAbs().maxCoeff(),
            1e-14 * relieved.cwiseAbs().maxCoeff());
  EXPECT_LT((decoupled - decoupled.transpose()).cwiseAbs().maxCoeff(),
            1e-12 * decoupled.cwiseAbs().maxCoeff());
  const NormalModes modes =
      body.modes(10, {}, {});  // Σ φ φᵀ/ω² over all elastic modes is the same flexibility
  EXPECT_LT((body.rigid().transpose() * (body.mass() * modes.shapes)).cwiseAbs().maxCoeff(), 1e-10);
}

/// From the constraint shapes as from a factorization of the whole body, whether it can move or
/// not.
TEST(ReduceFlexibility, OfTheInterfaceNeedsNoFactorOfTheBody) {
  ReductionOptions o = options_of(ReductionBasis::craig_bampton, 3, {"2", "6", "9"});
  for (const FeModel& beam : {space_beam(), clamped(space_beam(), "1")}) {
    const ReductionProgress silent;
    std::vector<std::string> warnings;
    BasisBuilder condensed(beam, o, silent, warnings), factored(beam, o, silent, warnings);
    condensed.build();
    const VecX expected = factored.interface_flexibility();
    ASSERT_EQ(expected.size(), 18);
    ASSERT_GT(expected.minCoeff(), 0);
    EXPECT_LT((condensed.interface_flexibility().cwiseQuotient(expected).array() - 1)
                  .cwiseAbs()
                  .maxCoeff(),
              1e-9);
    EXPECT_EQ(condensed.body().factor_nonzeros(), 0);
    EXPECT_GT(factored.body().factor_nonzeros(), 0);
  }
}

/// With whole normal modes the lowest frequencies are those of the model, with those of the held
/// interface they are above.
TEST(ReduceModes, OfTheWholeStructureOrWithTheInterfaceHeld) {
  const FeModel chain = spring_chain(5, 100);
  ReductionOptions o = options_of(ReductionBasis::craig_bampton, 2, {"1", "5"});
  o.normal = ReductionNormal::whole;
  expect_omegas(reduced(chain, o), {2.846296766, 8.308300260}, 1e-9);
  o.normal = ReductionNormal::automatic;
  EXPECT_GT(kTwoPi * reduced(chain, o).report.frequencies[0], 2.8467);
  o.basis = ReductionBasis::complement;
  expect_omegas(reduced(chain, o), {2.846296766, 8.308300260}, 1e-9);
  o.normal = ReductionNormal::omitted;  // the span of Craig-Bampton
  expect_omegas(reduced(chain, o), {2.846733147, 8.308494525, 13.26731315, 16.88817266}, 1e-9);
  o.basis = ReductionBasis::free_modes;
  EXPECT_THAT(refusal(chain, o),
              HasSubstr("modes with the interface held are for bases with static shapes"));
}

/// More normal modes bring every frequency of a Craig-Bampton basis down to the model's, never
/// below.
TEST(ReduceModes, CraigBamptonOfABeamConvergesFromAbove) {
  const FeModel beam = clamped(space_beam(), "1");
  const Reduction exact = reduced(beam, options_of(ReductionBasis::constrained_modes, 6));
  std::vector<double> before(6, 1e9);
  for (const int modes : {0, 2, 6, 12}) {
    const Reduction r = reduced(beam, options_of(ReductionBasis::craig_bampton, modes, {"9"}));
    for (int k = 0; k < 6; ++k) {
      EXPECT_GT(r.report.frequencies[k], exact.report.frequencies[k] * (1 - 1e-9)) << modes;
      EXPECT_LT(r.report.frequencies[k], before[k] * (1 + 1e-9)) << modes;
      before[k] = r.report.frequencies[k];
    }
  }
  for (int k = 0; k < 6; ++k) EXPECT_NEAR(before[k] / exact.report.frequencies[k], 1, 2e-3);
}

TEST(ReduceModes, HighestFrequencyInsteadOfANumber) {
  ReductionOptions o = options_of(ReductionBasis::free_modes, 0);
  o.max_frequency = 100 / kTwoPi;
  EXPECT_EQ(reduced(space_beam(), o).report.normal_modes, 3);
}

TEST(ReduceModes, NoneBelowTheHighestFrequencyIsARefusal) {
  ReductionOptions o = options_of(ReductionBasis::free_modes, 0);
  o.max_frequency = 1e-3;
  EXPECT_THAT(refusal(space_beam(), o), HasSubstr("no normal mode below the highest frequency"));
  o = options_of(ReductionBasis::craig_bampton, 0, {"1", "9"});
  o.max_frequency = 1e-3;
  const Reduction r = reduced(space_beam(), o);
  EXPECT_EQ(r.report.normal_modes, 0);
  EXPECT_EQ(r.report.static_shapes, 12);
}

TEST(ReduceModes, EqualFrequenciesAreCountedTogether) {
  const FeModel point = make_fe_model({"1"}, MatX::Zero(3, 1), {{0, 0}, {0, 1}},
                                      assembled(2, {{0, 0, 1.0}, {1, 1, 1.0}}),
                                      assembled(2, {{0, 0, 100.0}, {1, 1, 100.0}}));
  const Reduction r = reduced(point, options_of(ReductionBasis::constrained_modes, 2));
  expect_omegas(r, {10, 10}, 1e-12);
  for (const std::string& warning : r.report.warnings)
    EXPECT_THAT(warning, Not(HasSubstr("were found")));
}

TEST(ReduceModes, EffectiveMassesAddUpToTheMass) {
  const Reduction r =
      reduced(clamped(spring_chain(5), "1"), options_of(ReductionBasis::constrained_modes, 4));
  EXPECT_NEAR(r.report.effective_masses.row(0).sum(), 4, 1e-10);  // all but the held one
}

// ------------------------------------------------------------------------------------------------
// refusals

TEST(ReduceRefusals, MechanismsAreNamed) {
  EXPECT_THAT(refusal(space_beam(0), options_of(ReductionBasis::free_modes, 4)),
              AllOf(HasSubstr("singular or not positive definite at node "), HasSubstr(", rx")));
}

TEST(ReduceRefusals, WhatDoesNotFit) {
  const FeModel beam = space_beam();
  EXPECT_THAT(refusal(beam, options_of(ReductionBasis::craig_bampton, 4, {"77"})),
              HasSubstr("the model has no node 77"));
  EXPECT_THAT(refusal(beam, options_of(ReductionBasis::craig_bampton, 4)),
              HasSubstr("needs interface nodes"));
  EXPECT_THAT(refusal(beam, options_of(ReductionBasis::constrained_modes, 4)),
              HasSubstr("6 rigid motions"));
  EXPECT_THAT(refusal(beam, options_of(ReductionBasis::complement, 4, {"9"})),
              HasSubstr("use inertia relief"));
  ReductionOptions o = options_of(ReductionBasis::free_modes, 4);
  o.frame = ReductionFrame::point;
  EXPECT_THAT(refusal(beam, o), HasSubstr("choose mean axes"));
  o = options_of(ReductionBasis::free_modes, 60);
  EXPECT_THAT(refusal(beam, o), HasSubstr("60 normal modes asked for, the model has 48"));
  o = options_of(ReductionBasis::free_modes, 4);
  o.inertia = ReductionInertia::lumped;
  o.exposed = {"1", "9"};
  EXPECT_THAT(refusal(beam, o), HasSubstr("choose rigid inertia"));
  EXPECT_THAT(refusal(clamped(beam, "1"), options_of(ReductionBasis::inertia_decoupling, 4, {"9"})),
              HasSubstr("this one is supported"));
  o = options_of(ReductionBasis::free_modes, 4);
  o.max_frequency = -5;
  EXPECT_THAT(refusal(beam, o), HasSubstr("must not be negative"));
  o = options_of(ReductionBasis::craig_bampton, 4, {"1", "9"});
  o.interface_components = {{"5", "123"}};
  EXPECT_THAT(refusal(beam, o), HasSubstr("node 5, which is no interface node"));
}

TEST(ReduceRefusals, IndefiniteMatrices) {
  FeModel beam = space_beam();
  beam.stiffness *= -1;
  EXPECT_THAT(refusal(beam, options_of(ReductionBasis::free_modes, 4)),
              HasSubstr("not positive definite at node"));
  beam = space_beam();
  beam.mass *= -1;
  EXPECT_NE(refusal(beam, options_of(ReductionBasis::free_modes, 4)), "accepted");
  beam = space_beam();
  beam.mass.coeffRef(7, 7) = -5;
  EXPECT_NE(refusal(beam, options_of(ReductionBasis::free_modes, 4)), "accepted");
}

TEST(ReduceRefusals, InterfaceTwiceAndUnlumpedMass) {
  EXPECT_THAT(refusal(space_beam(), options_of(ReductionBasis::craig_bampton, 4, {"9", "9"})),
              HasSubstr("is an interface twice"));
  ReductionOptions o = options_of(ReductionBasis::constrained_modes, 3);
  o.inertia = ReductionInertia::lumped;
  o.must_be_lumped = true;
  EXPECT_THAT(refusal(clamped(planar_beam(10), "1"), o),
              HasSubstr("the mass matrix is not lumped"));
  EXPECT_EQ(refusal(clamped(space_beam(), "1"), o), "accepted");
}

std::string option_refusal(const std::string& name, const std::string& value) {
  ReductionJob job;
  try {
    job.set(name, value);
  } catch (const ReductionError& e) {
    return e.what();
  }
  return "accepted";
}

TEST(ReduceOptions, AreChecked) {
  for (const ReductionOptionHelp& help : reduction_option_help())
    EXPECT_THAT(option_refusal(help.name, "yes"), Not(HasSubstr("unknown option"))) << help.name;
  const std::tuple<const char*, const char*, const char*> cases[] = {
      {"shift", "2", "a number below zero expected"},
      {"shift", "-100", "accepted"},
      {"tolerance", "0", "between 0 and 1"},
      {"tolerance", "1e-8", "accepted"},
      {"rank-tolerance", "-1", "between 0 and 1"},
      {"normal", "some", "unknown choice `some`"},
      {"normal", "omitted", "accepted"},
      {"lumping", "row-sum", "unknown lumping"},
      {"lumping", "diagonal", "accepted"},
      {"modes", "-1", "a whole number expected"},
      {"modes", "1e300", "a whole number expected"},
      {"max-frequency", "inf", "a number expected"},
      {"max-frequency", "0", "a number above zero expected, got `0`"},
      {"frame", "point:1,2", "three coordinates"},
      {"components", "9", "`label:digits` expected"},
      {"components", "9:78", "component"},
      {"inertia", "heavy", "unknown inertia"},
      {"diagonalize", "maybe", "`yes` or `no` expected"},
      {"fancy", "1", "unknown option"}};
  for (const auto& [name, value, message] : cases)
    EXPECT_THAT(option_refusal(name, value), HasSubstr(message));
}

TEST(ReduceOptions, AreGivenOnceAndLaterSourcesCount) {
  ReductionJob job;
  read_job("a", "max-frequency = 5\n", job);
  EXPECT_EQ(job.options.max_frequency, 5);
  read_job("b", "modes = 3\n", job);
  EXPECT_EQ(job.options.modes, 3);
  EXPECT_EQ(job.options.max_frequency, 0);
  const auto job_refusal = [](const char* text) {
    ReductionJob read;
    try {
      read_job("j", text, read);
    } catch (const ReductionError& e) {
      return std::string(e.what());
    }
    return std::string("accepted");
  };
  EXPECT_EQ(job_refusal("modes = 3\n\nmodes = 4\n"), "j:3: `modes` is given twice");
  EXPECT_EQ(job_refusal("modes = 3\nmax-frequency = 4\n"),
            "j:2: both `modes` and `max-frequency` say how many normal modes there are (give one "
            "of them)");
}

TEST(ReduceRefusals, UnknownProcessor) {
  ReductionOptions o = options_of(ReductionBasis::free_modes, 4);
  o.processor = "abacus";
  EXPECT_THAT(refusal(space_beam(), o),
              HasSubstr("cannot do with `abacus` (accepted: auto, plain"));
}

TEST(ReduceRefusals, StopsWhenAsked) {
  const auto r = reduce(space_beam(), options_of(ReductionBasis::free_modes, 4),
                        [](const std::string&, double) { return false; });
  ASSERT_FALSE(r);
  EXPECT_EQ(r.error().kind, ErrorKind::cancelled);
}

// ------------------------------------------------------------------------------------------------
// input files

std::string model_refusal(const FeModelFiles& files) {
  try {
    make_fe_model(files);
  } catch (const ReductionError& e) {
    return e.what();
  }
  return "accepted";
}

TEST(FeModelFilesTest, RoundTripAndRefusals) {
  const FeModel chain = spring_chain(3, 100);
  FeModelFiles files{write_matrix_market(chain.mass), write_matrix_market(chain.stiffness),
                     "label,x,y,z\na,0,0,0\nb,1,0,0  # middle\nc,2,0,0\n", "a,1\nb,1\nc,1\n", ""};
  const FeModel again = make_fe_model(files);
  EXPECT_EQ((again.stiffness - chain.stiffness).norm(), 0);
  EXPECT_EQ(again.dof_text(2), "node c, ux");
  FeModelFiles bad = files;
  bad.dofs = "";
  EXPECT_THAT(model_refusal(bad), HasSubstr("6 rows for each of 3 nodes make 18"));
  bad = files;
  bad.nodes += "b,1,1,1\n";
  EXPECT_THAT(model_refusal(bad), HasSubstr("nodes:5: node b is there twice"));
  bad = files;
  bad.supports = "z,123\n";
  EXPECT_THAT(model_refusal(bad), HasSubstr("there is no node z"));
  bad = files;
  bad.mass = "%%MatrixMarket matrix coordinate real general\n2 2 2\n1 2 1.\n2 1 3.\n";
  EXPECT_THAT(model_refusal(bad), HasSubstr("not symmetric"));
  bad.mass = "%%MatrixMarket matrix coordinate real symmetric\n2 3 1\n1 1 1.\n";
  EXPECT_THAT(model_refusal(bad), HasSubstr("not square"));
  bad.mass = "%%MatrixMarket matrix coordinate real symmetric\n9 9 999999999999\n1 1 1.\n";
  EXPECT_THAT(model_refusal(bad), HasSubstr("too short"));
  bad.mass = "%%MatrixMarket matrix coordinate real symmetric\n2 2 1\n1 1 nan\n";
  EXPECT_THAT(model_refusal(bad), HasSubstr("not finite"));
  bad.mass = "%%MatrixMarket matrix coordinate real symmetric\n2 2 1\n3 1 1.\n";
  EXPECT_THAT(model_refusal(bad), HasSubstr("mass:3: entry (3, 1) lies outside"));
  bad.mass = "%%MatrixMarket matrix coordinate real symmetric\n2 2 2\n2 1 1.\n1 2 1.\n";
  EXPECT_THAT(model_refusal(bad), HasSubstr("mass:4: a `symmetric` matrix has the entries of one"));
  bad = files;
  bad.nodes = "a,0,0,0\nb,1e200,0,0\nc,2,0,0\n";
  EXPECT_THAT(model_refusal(bad), HasSubstr("nodes:2: a coordinate larger than"));
  bad.nodes = std::string(200, 'a') + ",0,0,0\n";
  EXPECT_THAT(model_refusal(bad), HasSubstr("a label of at most 100 characters"));
  bad.nodes = "a," + std::string(5000, 'x') + ",0,0\n";
  EXPECT_LT(model_refusal(bad).size(), 200U);
}

TEST(FeModelFilesTest, NumbersAreReadWholeOrRefused) {
  const auto matrix = [](const std::string& entry) {
    return parse_matrix_market(
        "k", "%%MatrixMarket matrix coordinate real symmetric\n1 1 1\n" + entry + "\n");
  };
  for (const char* text : {"1 1 1.5e+05", "1 1 1.5D+05", "1 1 1.5d5", " 1\t1   +1.5E+5 \r"})
    EXPECT_EQ(matrix(text).coeff(0, 0), 150000) << text;
  for (const char* text : {"1 1 1,5", "1 1 1.5 2", "1 1.5 3", "1 1 1.5e+05x", "1 1 0x12", "1,1,1",
                           "1 1 1e61", "1 1 inf", "1 1"})
    EXPECT_THROW((void)matrix(text), ReductionError) << text;
}

TEST(ReduceRefusals, NumbersThatOverflowAndTooManyShapes) {
  FeModel chain = spring_chain(3, 100);
  chain.stiffness.coeffRef(1, 1) = 1.7e308;
  EXPECT_THAT(refusal(chain, options_of(ReductionBasis::constrained_modes, 1)),
              HasSubstr("overflow"));
  EXPECT_THAT(refusal(spring_chain(3, 100), options_of(ReductionBasis::constrained_modes, 2001)),
              HasSubstr("more than 2000 shapes"));
  EXPECT_THAT(
      refusal(spring_chain(3), options_of(ReductionBasis::craig_bampton, 0, {"1", "2", "3"})),
      HasSubstr("all degrees of freedom belong to the interface"));
}

}  // namespace
}  // namespace mbcosim::reduce_test
