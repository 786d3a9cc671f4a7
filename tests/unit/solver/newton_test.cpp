/// Newton iteration, convergence tests, line search and step control.
#include <gmock/gmock.h>

#include <cmath>

#include "deck_run.h"
#include "solver/system.h"
#include "solver/watch.h"

namespace mbcosim::newton_test {
namespace {

using testing::HasSubstr;

/// Pendulum with a spherical joint and a second body; `initial`: cards of the initial value block.
std::string pendulum(const std::string& initial, const std::string& node_options = "") {
  return "begin: data; problem: initial value; end: data;\nbegin: initial value; initial time: 0.; "
         "final time: 1.;" +
         initial + R"( end: initial value;
begin: control data; structural nodes: 2; rigid bodies: 2; joints: 2; gravity; end: control data;
set: real L = .5; set: real W = 2.;
begin: nodes;
  structural: 1, dynamic, null, eye, null, 0.,W,0.)" +
         node_options + R"(;
  structural: 2, dynamic, 0.,0.,-L, eye, -W*L,0.,0., 0.,W,.3;
end: nodes;
begin: elements;
  body: 1, 1, 1.3, 0.,0.,-L, diag, .01,.02,.03;
  joint: 1, revolute pin, 1, null, hinge, 1, 1.,0.,0., 3, 0.,1.,0., null, hinge, 1, 1.,0.,0., 3, 0.,1.,0.;
  body: 2, 2, .7, .1,.05,-.1, diag, .01,.02,.03;
  joint: 2, spherical hinge, 1, 0.,0.,-L, 2, null;
  gravity: uniform, 0.,0.,-1., const, 9.81;
end: elements;
)";
}

const char* const kPlain = " time step: 1e-2; max iterations: 50; tolerance: 1e-9;";

std::vector<double> after(const std::string& deck, int steps) {
  DeckRun run(deck);
  if (!run.ready()) return {};
  run.step(steps);
  return run.simulation().state().y;
}

double distance(const std::vector<double>& a, const std::vector<double>& b) {
  double d = 0;
  for (std::size_t i = 0; i < a.size(); ++i) d = std::max(d, std::abs(a[i] - b[i]));
  return a.empty() || a.size() != b.size() ? HUGE_VAL : d;
}

/// Springs between a node and the ground, with one force.
std::string springs(int count, const std::string& drive) {
  std::string deck = initial_value_block(1e-3, 1, "max iterations: 20; tolerance: 1e-9;") +
                     "begin: control data; structural nodes: 2; rigid bodies: 1; joints: " +
                     std::to_string(count) + "; forces: 1; " + R"( end: control data;
begin: nodes; structural: 1, static, null, eye, null, null; structural: 2, dynamic, 1.,0.,0., eye, null, null; end: nodes;
begin: elements; body: 1, 2, 1., null, eye; joint: 1, clamp, 1, node, node;
force: 1, absolute, 2, position, null, 1.,0.,0., )" +
                     drive + ";\n";
  for (int k = 2; k <= count; ++k)
    deck += "joint: " + std::to_string(k) + ", rod, 1, 2, 1., linear elastic, 1.;\n";
  return deck + "end: elements;\n";
}

struct Asked {
  int looks = 0, most = 0;
  static void look(const void* of) {
    auto* self = static_cast<Asked*>(const_cast<void*>(of));
    if (++self->looks > self->most) throw Stopped();
  }
};

// A deadline, Interrupt or DeleteSimulation must not wait for all elements of a large model, nor
// for one that evaluates much.
TEST(Evaluations, LookBetweenElementsAndWithinHeavyDrivesWhetherTheyAreWanted) {
  std::string series = "fourier series, 0., 1., 2000, 0.";
  for (int k = 0; k < 4000; ++k) series += ", 0.";
  series += ", forever, 0.";
  for (const std::string& deck : {springs(4000, "const, 1."), springs(2, series)}) {
    DeckRun run(deck);
    ASSERT_TRUE(run.ready());
    Scratch scratch(run.model().scratch);
    std::vector<double> r(run.model().unknowns);
    const auto looks = [&](int most) {
      Asked asked{0, most};
      scratch.interruption = {&Asked::look, &asked};
      compute_residual(run.model().context(run.simulation().state(), Phase::step, 1e-3, 1e-3),
                       scratch, r);
      return asked.looks;
    };
    EXPECT_GT(looks(1000), 0);
    EXPECT_THROW((void)looks(0), Stopped);
    EXPECT_GT(looks(1000), 0);
  }
}

class NewtonVariants : public testing::TestWithParam<const char*> {};

TEST_P(NewtonVariants, GiveTheSolutionOfNewtonRaphson) {
  const std::vector<double> plain = after(pendulum(kPlain), 50),
                            other = after(pendulum(std::string(kPlain) + GetParam()), 50);
  EXPECT_LT(distance(plain, other), 1e-6);
}

INSTANTIATE_TEST_SUITE_P(
    All, NewtonVariants,
    testing::Values("nonlinear solver: newton raphson, modified, 4;",
                    "nonlinear solver: newton raphson, modified, 7, keep jacobian matrix;",
                    "newton raphson: modified;", "nonlinear solver: line search;",
                    "nonlinear solver: line search, modified, 3, algorithm, factor;",
                    "nonlinear solver: matrix free, gmres;",
                    "method: ms, 0.; modify residual test;", "linear solver: umfpack;"));

class NewtonVariantsOfThirdOrder : public testing::TestWithParam<const char*> {};

TEST_P(NewtonVariantsOfThirdOrder, GiveTheSolutionOfNewtonRaphson) {
  const std::string method = std::string(kPlain) + "method: third order, .6;";
  const std::vector<double> plain = after(pendulum(method), 50),
                            other = after(pendulum(method + GetParam()), 50);
  EXPECT_LT(distance(plain, other), 1e-6);
}

INSTANTIATE_TEST_SUITE_P(
    All, NewtonVariantsOfThirdOrder,
    testing::Values("nonlinear solver: newton raphson, modified, 4;",
                    "nonlinear solver: newton raphson, modified, 7, keep jacobian matrix;",
                    "nonlinear solver: line search;",
                    "nonlinear solver: line search, modified, 3, algorithm, factor;"));

class ModifiedNewton : public testing::TestWithParam<const char*> {};

TEST_P(ModifiedNewton, NeedsMoreIterations) {
  const auto iterations = [&](const std::string& more) {
    DeckRun run(pendulum(std::string(kPlain) + GetParam() + more));
    return run.simulation().step_many(30).total_iterations;
  };
  EXPECT_GT(iterations("nonlinear solver: newton raphson, modified, 20;"), iterations(""));
}

TEST_P(ModifiedNewton, KeepsTheMatrixInTheState) {
  const std::string deck =
      pendulum(std::string(kPlain) + GetParam() +
               "nonlinear solver: newton raphson, modified, 20, keep jacobian matrix;");
  DeckRun run(deck);
  ASSERT_TRUE(run.ready());
  run.step(7);
  const std::string bytes = run.simulation().export_state();
  run.step(10);
  const std::vector<double> expected = run.simulation().state().y;
  DeckRun other(deck);
  ASSERT_TRUE(other.simulation().import_state(bytes));
  other.step(10);
  EXPECT_EQ(other.simulation().state().y, expected);
}

INSTANTIATE_TEST_SUITE_P(Methods, ModifiedNewton,
                         testing::Values("method: ms, 0.;", "method: third order, .6;",
                                         "method: third order, ad hoc;"));

StepReport first_steps(const std::string& initial, int count = 3,
                       const std::string& node_options = "") {
  DeckRun run(pendulum(initial, node_options));
  EXPECT_TRUE(run.ready());
  return run.ready() ? run.simulation().step_many(count) : StepReport{};
}

TEST(Convergence, AtMostAcceptsADecreasedError) {
  EXPECT_TRUE(first_steps("time step: 1e-2; max iterations: 1; tolerance: 1e-12;").error);
  EXPECT_FALSE(first_steps("time step: 1e-2; max iterations: 1, at most; tolerance: 1e-12;").error);
}

TEST(Convergence, FailureNamesTheWorstEquations) {
  const StepReport report = first_steps("time step: 1e-2; max iterations: 1; tolerance: 1e-12;");
  ASSERT_TRUE(report.error);
  EXPECT_EQ(report.error->kind, ErrorKind::not_converged);
  EXPECT_EQ(report.error->failure.residual_history.size(), 2u);
  EXPECT_FALSE(report.error->failure.worst.empty());
  EXPECT_THAT(report.error->message, HasSubstr("residual"));
}

/// A cantilever whose load comes at once: the matrices of an iteration that runs away are singular
/// to rounding, and accuse elements that are not at fault.
std::string overloaded_cantilever(const std::string& clamp) {
  return R"(begin: data; problem: initial value; end: data;
begin: initial value; initial time: 0.; final time: 1.; time step: .1; max iterations: 30; tolerance: 1e-6;
  derivatives tolerance: 1e9; end: initial value;
begin: control data; structural nodes: 3; beams: 1; joints: 1; forces: 1; model: static; end: control data;
begin: nodes;
  structural: 1, static, null, eye, null, null;
  structural: 2, static, 1.,0.,0., eye, null, null;
  structural: 3, static, 2.,0.,0., eye, null, null;
end: nodes;
begin: elements;
  joint: 1, )" +
         clamp +
         R"(;
  force: 1, absolute, 3, position, null, 0.,0.,1., const, 1e6;
  beam3: 1, 1, null, 2, null, 3, null, eye,
    linear elastic generic, diag, 1e6, 1e6, 1e6, 100., 100., 200., same, same;
end: elements;
)";
}

TEST(Convergence, DivergenceIsToldApartFromAModelAtFault) {
  using testing::Not;
  const auto message = [](const std::string& clamp) {
    DeckRun run(overloaded_cantilever(clamp));
    if (!run.ready()) return std::string("deck refused");
    const StepReport report = run.simulation().step();
    return report.error ? report.error->message : std::string("no error");
  };
  EXPECT_THAT(message("clamp, 1, node, node"),
              AllOf(HasSubstr("diverged"), HasSubstr("time step"), Not(HasSubstr("singular"))));
  EXPECT_THAT(message("spherical pin, 1, null, null"),
              AllOf(HasSubstr("singular"), HasSubstr("nothing determines")));
}

TEST(Convergence, MinmaxIsTheLargestEntry) {
  const double
      norm = first_steps(
                 "time step: 1e-2; max iterations: 2, at most; tolerance: 1e-20, test, norm;", 1)
                 .residual_error,
      minmax =
          first_steps(
              "time step: 1e-2; max iterations: 2, at most; tolerance: 1e-20, test, minmax;", 1)
              .residual_error;
  EXPECT_GT(norm, 0);
  EXPECT_LE(minmax, norm);
  EXPECT_GE(minmax, norm / std::sqrt(40.0));
}

TEST(Convergence, ScaleWeighsTheRowsOfTheirOwner) {
  const std::string initial =
      "time step: 1e-2; max iterations: 1, at most; tolerance: 1e-20, test, minmax, scale; "
      "derivatives tolerance: 1.;";
  const double plain = first_steps(initial, 1).residual_error,
               scaled = first_steps(initial, 1, ", assembly, 1., 1., scale, 1e6").residual_error;
  EXPECT_GT(scaled, 100 * plain);
}

TEST(Convergence, BySolution) {
  const StepReport report =
      first_steps("time step: 1e-2; max iterations: 20; tolerance: null, 1e-6, test, norm;");
  EXPECT_FALSE(report.error);
  EXPECT_GT(report.solution_error, 0);
  EXPECT_LT(report.solution_error, 1e-6);
}

TEST(Convergence, WithoutResidualTestTheSolutionDecides) {
  const StepReport report = first_steps(
      "time step: 1e-2; max iterations: 20; tolerance: 1e-6, test, none, 1e-6, test, minmax;");
  EXPECT_FALSE(report.error);
  EXPECT_GE(report.iterations, 1);
}

TEST(Convergence, ConstraintViolationsAreWeighed) {
  // c v = (h/2)/h in the first step: constraint rows count half.
  const std::string initial =
      "time step: 1e-2; max iterations: 1, at most; tolerance: 1e-20, test, minmax;";
  const double
      rates = first_steps(initial, 1).residual_error,
      violations =
          first_steps(
              initial + "enforce constraint equations: constraint violations, scale factor, 1e9;",
              1)
              .residual_error;
  EXPECT_GT(violations, rates);
}

TEST(Convergence, MaxResidualStopsTheIteration) {
  const StepReport report =
      first_steps("time step: 1e-2; max iterations: 20; tolerance: 1e-9; max residual: 1e-8;", 1);
  ASSERT_TRUE(report.error);
  EXPECT_EQ(report.error->failure.iteration, 0);
  EXPECT_THAT(
      report.error->message,
      testing::HasSubstr("the residual exceeds the card `max residual` after 0 iterations"));
  // ... unless the step is hardly longer than the shortest allowed.
  EXPECT_FALSE(first_steps("time step: 1e-2; min time step: 6e-3; max iterations: 20; tolerance: "
                           "1e-9; max residual: 1e-8;",
                           1)
                   .error);
}

/// Scalar equation atan(x) = 0 from x = 5, where Newton's iteration diverges.
std::string arc_tangent(const std::string& more) {
  return "begin: data; problem: initial value; end: data;\nbegin: initial value; initial time: 0.; "
         "final time: 1.; time step: .1; tolerance: 1e-9; max iterations: 50; derivatives "
         "tolerance: "
         "10.; method: implicit euler; " +
         more + R"deck(end: initial value;
begin: control data; abstract nodes: 1; genels: 1; end: control data;
begin: nodes; abstract: 1, differential, value, 5.; end: nodes;
begin: elements;
  genel: 1, spring support, 1, abstract, algebraic,
    symbolic elastic, epsilon, "e", expression, "atan(e)";
end: elements;
)deck";
}

TEST(LineSearch, ConvergesWhereNewtonDiverges) {
  DeckRun plain(arc_tangent(""));
  ASSERT_TRUE(plain.ready());
  EXPECT_TRUE(plain.simulation().step().error);
  for (const char* algorithm : {"cubic", "factor"}) {
    DeckRun run(arc_tangent("nonlinear solver: line search, algorithm, " + std::string(algorithm) +
                            ", lambda min, 1e-4;"));
    ASSERT_TRUE(run.ready());
    run.step();
    EXPECT_NEAR(run.scalar_node(ScalarKind::abstract, 1), 0, 1e-8) << algorithm;
  }
}

/// atan(x) = 1.4, which the first step keeps, then atan(x) = 0 from there: the same divergence, in
/// a step of the third-order method.
std::string dropped_arc_tangent(const std::string& more) {
  return "begin: data; problem: initial value; end: data;\nbegin: initial value; initial time: 0.; "
         "final time: 1.; time step: .1; tolerance: 1e-9; max iterations: 50; derivatives "
         "tolerance: 10.; method: third order, .6; " +
         more + R"deck(end: initial value;
begin: control data; abstract nodes: 1; genels: 1; forces: 1; end: control data;
begin: nodes; abstract: 1, differential, value, 5.797883715; end: nodes;
begin: elements;
  genel: 1, spring support, 1, abstract, algebraic,
    symbolic elastic, epsilon, "e", expression, "atan(e)";
  force: 2, abstract, 1, abstract, step, .12, -1.4, 1.4;
end: elements;
)deck";
}

TEST(LineSearch, ConvergesInTheThirdOrderMethodToo) {
  DeckRun plain(dropped_arc_tangent(""));
  ASSERT_TRUE(plain.ready());
  plain.step();
  EXPECT_TRUE(plain.simulation().step().error);
  DeckRun run(dropped_arc_tangent("nonlinear solver: line search, lambda min, 1e-4;"));
  ASSERT_TRUE(run.ready());
  run.step();
  EXPECT_NEAR(run.scalar_node(ScalarKind::abstract, 1), 5.798, 1e-3);
  run.step();
  EXPECT_NEAR(run.scalar_node(ScalarKind::abstract, 1), 0, 1e-8);
}

TEST(LineSearch, GivesUpAtTheSmallestStep) {
  DeckRun run(arc_tangent("nonlinear solver: line search, lambda min, .9, relative, no;"));
  ASSERT_TRUE(run.ready());
  const StepReport report = run.simulation().step();
  ASSERT_TRUE(report.error);
  EXPECT_EQ(report.error->kind, ErrorKind::not_converged);
}

/// A spring that is not in balance as read: the start needs a rate of 1/c.
TEST(LineSearch, LeavesTheDerivativesPhaseItsFullStep) {
  DeckRun run(
      "begin: data; problem: initial value; end: data; begin: initial value; final time: 1.; time "
      "step: .1; max iterations: 20; nonlinear solver: line search; end: initial value; begin: "
      "control data; end: control data; begin: nodes; abstract: 1; end: nodes; begin: elements; "
      "genel: 1, spring support, 1, abstract, algebraic, linear elastic, 2.; force: 1, abstract, "
      "1, abstract, const, 3.; end: elements;");
  ASSERT_TRUE(run.ready());
  EXPECT_NEAR(run.scalar_node(ScalarKind::abstract, 1), 1.5, 1e-6);
  run.step();
  EXPECT_NEAR(run.scalar_node(ScalarKind::abstract, 1), 1.5, 1e-6);
}

/// Far from the start the slope is steeper than that of the first matrix: its steps are too long
/// for the smallest fraction.
TEST(LineSearch, TakesANewMatrixWhereAnEarlierOneLeadsNowhere) {
  for (const char* keep : {"", ", keep jacobian matrix"}) {
    DeckRun run(arc_tangent("nonlinear solver: line search, modified, 30" + std::string(keep) +
                            ", lambda min, .1, relative, no;"));
    ASSERT_TRUE(run.ready());
    run.step();
    EXPECT_NEAR(run.scalar_node(ScalarKind::abstract, 1), 0, 1e-8) << keep;
  }
}

std::vector<double> step_sizes(const std::string& initial, int count) {
  DeckRun run(pendulum("max iterations: 30; tolerance: 1e-10; " + initial));
  std::vector<double> h;
  for (int k = 0; k < count && run.ready(); ++k) {
    run.step();
    h.push_back(run.simulation().state().h);
  }
  return h;
}

TEST(StepControl, ChangeFollowsItsDriveAtTheLastTime) {
  DeckRun run(
      pendulum("max iterations: 30; tolerance: 1e-10; time step: 1e-2; method: ms, .6; strategy: "
               "change, cosine, 0., 10., .004, "
               "forever, .004; min time step: 1e-3; max time step: .05;"));
  ASSERT_TRUE(run.ready());
  for (const double expected : {0.01, 0.02, 0.0240797336886, 0.0281951411405}) {
    run.step();
    EXPECT_NEAR(run.simulation().time(), expected, 1e-12);
  }
  run.step(135);
  EXPECT_NEAR(run.simulation().time(), 1.00619917106, 1e-10);
}

TEST(StepControl, FactorCountsTheStepsSinceChanges) {
  const std::vector<double> h = step_sizes(
      "time step: 1e-2; method: ms, .6; strategy: factor, .5, 1, 1.2, 2, 5, 6; min time step: "
      "1e-4; max time step: .02;",
      16);
  ASSERT_EQ(h.size(), 16u);
  for (int k = 0; k < 16; ++k)
    EXPECT_NEAR(h[k],
                k < 4    ? .01
                : k < 7  ? .012
                : k < 10 ? .0144
                : k < 13 ? .01728
                         : .02,
                1e-12)
        << k;
}

TEST(StepControl, FactorShortensTheStepUntilItConverges) {
  // Two iterations are too few for long steps.
  DeckRun run(
      pendulum("time step: .1; max iterations: 2; tolerance: 1e-6; method: ms, .6; derivatives "
               "tolerance: 1e-3; "
               "strategy: factor, .5, 1, 1.2, 100, 1, 2; min time step: 1e-6;"));
  ASSERT_TRUE(run.ready());
  const StepReport report = run.simulation().step_many(5);
  ASSERT_FALSE(report.error) << report.error->message;
  EXPECT_LT(report.step_size, .1);
}

TEST(StepControl, GivesUpAtTheShortestStepAndKeepsTheState) {
  DeckRun run(
      pendulum("time step: .1; max iterations: 1; tolerance: 1e-14; derivatives tolerance: 1e-3; "
               "strategy: factor, .5, 1, 1.2, 100, 1, 2; min time step: .03;"));
  ASSERT_TRUE(run.ready());
  const std::string before = run.simulation().export_state();
  const StepReport report = run.simulation().step();
  ASSERT_TRUE(report.error);
  EXPECT_TRUE(run.simulation().export_state() == before);
  EXPECT_EQ(run.simulation().time(), 0);
  EXPECT_NEAR(report.error->failure.time, .03, 1e-12);  // the last chance: the shortest step
}

TEST(StepControl, EndsWithoutAShortestStepToo) {
  DeckRun run(
      pendulum("time step: .1; max iterations: 1; tolerance: 1e-30; derivatives tolerance: 1e-3; "
               "strategy: factor, .5, 1, 1.2, 100, 1, 2;"));
  ASSERT_TRUE(run.ready());
  EXPECT_TRUE(run.simulation().step_many(3).error);
}

TEST(StepControl, RefusesToStandStillOrGoBack) {
  for (const auto& [length, told] : {std::pair("0.", "0"), {"-1e-9", "-1e-09"}}) {
    const StepReport report =
        first_steps("time step: 1e-2; max iterations: 20; strategy: change, const, " +
                    std::string(length) + ";");
    ASSERT_TRUE(report.error) << length;
    EXPECT_THAT(report.error->message,
                testing::HasSubstr("`strategy: change` asks for a step of " + std::string(told) +
                                   " s: a step is longer than 0"));
    EXPECT_FALSE(first_steps("time step: 1e-2; max iterations: 20; min time step: 1e-3; "
                             "strategy: change, const, " +
                             std::string(length) + ";")
                     .error);
  }
}

TEST(StepControl, RefusesContradictions) {
  for (const char* bad :
       {"max iterations: 5; strategy: factor, .5, 1, 1.2, 2, 5;",
        "strategy: factor, .5, 1, 1.2, 2, 5, 5;", "strategy: factor, 1.5, 1, 1.2, 2, 5, 6;",
        "strategy: factor, .5, 1, .9, 2, 5, 6;", "strategy: factor, .5, 0, 1.2, 2, 5, 6;",
        "strategy: change, const, 1e-2; min time step: .2; max time step: .1;",
        "strategy: change, const, 1e-2; min time step: .02;",
        "strategy: change, const, 1e-2; max time step: 1e-3;"}) {
    const LoadReport report = load_deck(
        BundleSource({{"deck.mbd", pendulum(std::string("time step: 1e-2; ") + bad)}}), "deck.mbd");
    EXPECT_FALSE(report.ok()) << bad;
  }
}

}  // namespace
}  // namespace mbcosim::newton_test
