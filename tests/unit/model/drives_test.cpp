/// Values and derivatives of the drives against tables printed by the reference solver (time step
/// 0.0625).
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "math/rotation.h"
#include "model/drives/closed_form_drives.h"
#include "model/drives/composed_drives.h"
#include "model/drives/oscillating_drives.h"
#include "model/drives/step_driven_drives.h"
#include "model/functions/scalar_functions.h"
#include "model/model.h"

namespace mbcosim::drives_test {
namespace {

constexpr double kForever = std::numeric_limits<double>::infinity();
constexpr double kStep = 0.0625;

DrivePtr polynomial(double c0, double c1, double c2, double c3) {
  return std::make_shared<PolynomialDrive>(std::array<double, 4>{c0, c1, c2, c3});
}
DrivePtr linear(double c0, double c1) { return polynomial(c0, c1, 0, 0); }
DrivePtr step(double t0, double t1, double s, double i) {
  return std::make_shared<StepDrive>(t0, t1, s, i);
}
DrivePtr ramp(DoubleRampDrive::Slope up, DoubleRampDrive::Slope down, double i) {
  return std::make_shared<DoubleRampDrive>(up, down, i);
}
DrivePtr sine(double t0, double omega, double a, int cycles, double i) {
  return std::make_shared<SineDrive>(t0, omega, a, cycles, i);
}
DrivePtr cosine(double t0, double omega, double a, int cycles, double i) {
  return std::make_shared<CosineDrive>(t0, omega, a, cycles, i);
}
ScalarFunctionPtr spline(std::vector<double> x, std::vector<double> y) {
  return std::make_shared<CubicSplineFunction>(FunctionPoints{std::move(x), std::move(y), true});
}

/// Evenly spaced samples (1, 10) (3, 20) (2, 40) from 0.5 s on, one a second.
FileDriverPtr file1() {
  SampleTable t;
  t.channels = 2;
  t.t0 = 0.5;
  t.dt = 1;
  t.values = {1, 10, 3, 20, 2, 40};
  return std::make_shared<TableDriver>(t, TableOptions{});
}
/// Samples (0.5, 1) (1.5, 3) (2, 2).
FileDriverPtr file2(bool linear = true, bool pad = false) {
  SampleTable t;
  t.times = {.5, 1.5, 2};
  t.values = {1, 3, 2};
  TableOptions options;
  options.linear = linear;
  options.pad_zeros = pad;
  return std::make_shared<TableDriver>(t, options);
}

/// Runs steps of equal length and lets step-driven drives advance.
class DriveTable : public testing::Test {
 protected:
  template <class D>
  std::shared_ptr<D> listen(std::shared_ptr<D> drive) {
    listeners_.push_back(drive);
    return drive;
  }
  int allocate(int count, double initial = 0) {
    const int offset = static_cast<int>(state_.memory.size());
    state_.memory.resize(offset + count, initial);
    return offset;
  }
  std::shared_ptr<ClosestNextDrive> closest_next(double t0, double t1, DrivePtr increment) {
    const int memory = allocate(ClosestNextDrive::kMemory);
    state_.memory[memory + 1] = t0;
    return std::make_shared<ClosestNextDrive>(memory, t1, std::move(increment));
  }
  std::shared_ptr<ClosestNextDrive> closest_next(double t0, double t1, double increment) {
    return closest_next(t0, t1, make_constant_drive(increment));
  }
  DrivePtr sample_and_hold(DrivePtr trigger, double initial) {
    const int memory = allocate(SampleAndHoldDrive::kMemory, initial);
    return listen(std::make_shared<SampleAndHoldDrive>(memory, linear(0, 1), trigger));
  }
  std::shared_ptr<DiscreteFilterDrive> discrete_filter(std::vector<double> a, double b0,
                                                       std::vector<double> b, DrivePtr input) {
    const int memory = allocate(1 + static_cast<int>(a.size() + b.size()));
    return listen(std::make_shared<DiscreteFilterDrive>(memory, std::move(a), b0, std::move(b),
                                                        std::move(input)));
  }
  EvalContext context() const {
    EvalContext c;
    c.state = &state_;
    c.time = state_.time;
    c.h = state_.h;
    return c;
  }
  void advance_to(int number, double h = kStep) {
    state_.step = number;
    state_.time = number * h;
    state_.h = h;
    for (const auto& listener : listeners_) listener->advance(context(), state_, number == 0);
    for (const auto& listener : listeners_) listener->after_convergence(context(), state_);
  }
  /// Numbers of the steps up to `last` in which a drive is not 0.
  std::vector<int> steps_of(const Drive& drive, int last) {
    std::vector<int> steps;
    for (int number = 0; number <= last; ++number) {
      advance_to(number);
      if (drive.value(context()) != 0) steps.push_back(number);
    }
    return steps;
  }

  State state_;
  std::vector<std::shared_ptr<const StepListener>> listeners_;
};

struct Row {
  std::string deck;
  DrivePtr drive;
  std::vector<double> values;       ///< at kTimes
  std::vector<double> derivatives;  ///< at kDerivativeTimes; may be empty
};
constexpr std::array<double, 11> kTimes{0, 0.5, 0.6875, 0.75, 1, 1.25, 1.6875, 2, 2.5, 3, 3.5};
constexpr std::array<double, 7> kDerivativeTimes{0.25, 0.5, 1, 1.25, 2, 2.5, 3};

/// Seven printed digits.
double allowance(double printed) { return 1e-6 * std::max(1.0, std::abs(printed)); }

TEST_F(DriveTable, MatchesReferenceSolver) {
  const std::vector<Row> rows = {
      {"step, 1., 2., .5",
       step(1, kForever, 2, .5),
       {0.5, 0.5, 0.5, 0.5, 1.25, 2.5, 2.5, 2.5, 2.5, 2.5, 2.5},
       {}},
      {"double step, 1., 2., 3., .5",
       step(1, 2, 3, .5),
       {0.5, 0.5, 0.5, 0.5, 1.75, 3.5, 3.5, 1.75, 0.5, 0.5, 0.5},
       {}},
      {"ramp, 2., 1., 2., .5",
       ramp({2, 1, 2}, {0, 0, 0}, .5),
       {0.5, 0.5, 0.5, 0.5, 0.5, 1, 1.875, 2.5, 2.5, 2.5, 2.5},
       {}},
      {"double ramp, 2., .5, 1., -1., 2., 3., .5",
       ramp({2, .5, 1}, {-1, 2, 3}, .5),
       {0.5, 0.5, 0.875, 1, 1.5, 1.5, 1.5, 1.5, 1, 0.5, 0.5},
       {}},
      {"piecewise linear, 4, 0.5, 1., 1., 2., 2., -1., 3., 0.",
       std::make_shared<PiecewiseLinearDrive>(std::vector<double>{.5, 1, 2, 3},
                                              std::vector<double>{1, 2, -1, 0}),
       {1, 1, 1.375, 1.5, 2, 1.25, -0.0625, -1, -0.5, 0, 0},
       {}},
      {"sine, .5, 2.*pi, 3., 2, .5",
       sine(.5, 2 * kPi, 3, 2, .5),
       {0.5, 0.5, 3.271639, 3.5, 0.5, -2.5, 3.271639, 0.5, 0.5, 0.5, 0.5},
       {0, 9.424778, -18.84956, 0, -9.424778, 0, 0}},
      {"sine, .5, 2.*pi, 3., half, .5",
       sine(.5, 2 * kPi, 3, -1, .5),
       {0.5, 0.5, 3.271639, 3.5, 3.5, 3.5, 3.5, 3.5, 3.5, 3.5, 3.5},
       {0, 9.424778, 0, 0, 0, 0, 0}},
      {"sine, .5, 2.*pi, 3., one, .5",
       sine(.5, 2 * kPi, 3, 1, .5),
       {0.5, 0.5, 3.271639, 3.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5, 0.5},
       {0, 9.424778, -9.424778, 0, 0, 0, 0}},
      {"sine, .5, 2.*pi, 3., -2, .5",
       sine(.5, 2 * kPi, 3, -2, .5),
       {0.5, 0.5, 3.271639, 3.5, 0.5, -2.5, 3.271639, 3.5, 3.5, 3.5, 3.5},
       {0, 9.424778, -18.84956, 0, 0, 0, 0}},
      {"sine, .5, 2.*pi, 3., forever, .5",
       sine(.5, 2 * kPi, 3, 0, .5),
       {0.5, 0.5, 3.271639, 3.5, 0.5, -2.5, 3.271639, 0.5, 0.5, 0.5, 0.5},
       {0, 9.424778, -18.84956, 0, -18.84956, 18.84956, -18.84956}},
      {"cosine, .5, 2.*pi, 3., 2, .5",
       cosine(.5, 2 * kPi, 3, 2, .5),
       {0.5, 0.5, 2.35195, 3.5, 6.5, 3.5, 2.35195, 6.5, 0.5, 0.5, 0.5},
       {0, 0, 0, -18.84956, 0, 0, 0}},
      {"cosine, .5, 2.*pi, 3., half, .5",
       cosine(.5, 2 * kPi, 3, -1, .5),
       {0.5, 0.5, 2.35195, 3.5, 6.5, 6.5, 6.5, 6.5, 6.5, 6.5, 6.5},
       {0, 0, 0, 0, 0, 0, 0}},
      {"cosine, .5, 2.*pi, 3., one, .5",
       cosine(.5, 2 * kPi, 3, 1, .5),
       {0.5, 0.5, 2.35195, 3.5, 6.5, 3.5, 0.5, 0.5, 0.5, 0.5, 0.5},
       {0, 0, 0, -18.84956, 0, 0, 0}},
      {"cosine, .5, 2.*pi, 3., -2, .5",
       cosine(.5, 2 * kPi, 3, -2, .5),
       {0.5, 0.5, 2.35195, 3.5, 6.5, 3.5, 2.35195, 6.5, 6.5, 6.5, 6.5},
       {0, 0, 0, -18.84956, 0, 0, 0}},
      {"cosine, .5, 2.*pi, 3., forever, .5",
       cosine(.5, 2 * kPi, 3, 0, .5),
       {0.5, 0.5, 2.35195, 3.5, 6.5, 3.5, 2.35195, 6.5, 0.5, 6.5, 0.5},
       {0, 0, 0, -18.84956, 0, 0, 0}},
      {"fourier series, .5, 2.*pi, 2, 1., 2., 3., 4., 5., 2, .5",
       std::make_shared<FourierSeriesDrive>(.5, 2 * kPi, 1, std::vector<double>{2, 4},
                                            std::vector<double>{3, 5}, 2, .5),
       {0.5, 7, 5.244112, 0, 3, -6, 5.244112, 3, 0.5, 0.5, 0.5},
       {}},
      {"frequency sweep, .5, linear, 1., 2., linear, 1., .5, .25, 3., -.75",
       std::make_shared<FrequencySweepDrive>(.5, linear(1, 2), linear(1, .5), .25, 3, -.75),
       {0.25, 0.25, 0.8288068, 1.054509, 1.746242, 1.05262, -1.382901, 2.126, -0.9572891, -0.75,
        -0.75},
       {}},
      {"exponential, 2., .5, 1., .25",
       std::make_shared<ExponentialDrive>(2, .5, 1, .25),
       {0.25, 0.25, 0.25, 0.25, 0.25, 1.036939, 1.744321, 1.979329, 2.150426, 2.213369, 2.236524},
       {}},
      {"tanh, 1., 2., 3., .25",
       std::make_shared<TanhDrive>(1, 2, 3, .25),
       {-1.74011, -1.560297, -1.218143, -1.020298, 0.25, 1.520298, 2.186374, 2.24011, 2.249506,
        2.249975, 2.249999},
       {}},
      {"linear, 1., 2.", linear(1, 2), {1, 2, 2.375, 2.5, 3, 3.5, 4.375, 5, 6, 7, 8}, {}},
      {"parabolic, 1., 2., 3.",
       polynomial(1, 2, 3, 0),
       {1, 2.75, 3.792969, 4.1875, 6, 8.1875, 12.91797, 17, 24.75, 34, 44.75},
       {3.5, 5, 8, 9.5, 14, 17, 20}},
      {"cubic, 1., 2., 3., 4.",
       polynomial(1, 2, 3, 4),
       {1, 3.25, 5.092773, 5.875, 10, 16, 32.13965, 49, 87.25, 142, 216.25},
       {4.25, 8, 20, 28.25, 62, 92, 128}},
      {"time", linear(0, 1), {0, 0.5, 0.6875, 0.75, 1, 1.25, 1.6875, 2, 2.5, 3, 3.5}, {}},
      {"timestep",
       std::make_shared<TimeStepDrive>(),
       {0.0625, 0.0625, 0.0625, 0.0625, 0.0625, 0.0625, 0.0625, 0.0625, 0.0625, 0.0625, 0.0625},
       {}},
      {"const, 3.5",
       make_constant_drive(3.5),
       {3.5, 3.5, 3.5, 3.5, 3.5, 3.5, 3.5, 3.5, 3.5, 3.5, 3.5},
       {}},
      {"mult, sine, 0., 1., 2., forever, 0., linear, 1., 2.",
       std::make_shared<ProductDrive>(sine(0, 1, 2, 0, 0), linear(1, 2)),
       {0, 1.917702, 3.014384, 3.408194, 5.048826, 6.642892, 8.690481, 9.092974, 7.181666, 1.97568,
        -5.612532},
       {3.896353, 5.428032, 6.607698, 6.003195, -0.5242787, -7.219835, -13.29541}},
      {"array, 3, const, 1., sine, 0., 1., 2., forever, 0., time",
       std::make_shared<SumDrive>(
           std::vector<DrivePtr>{make_constant_drive(1), sine(0, 1, 2, 0, 0), linear(0, 1)}),
       {1, 2.458851, 2.956714, 3.113278, 3.682942, 4.147969, 4.673896, 4.818595, 4.696944, 4.28224,
        3.798434},
       {2.937825, 2.755165, 2.080605, 1.630645, 0.1677063, -0.6022872, -0.979985}},
      {"drive, parabolic, 1., 2., 3., sine, 0., 1., 2., forever, 0.",
       std::make_shared<ChainDrive>(polynomial(1, 2, 3, 0), sine(0, 1, 2, 0, 0)),
       {1, 5.675888, 8.371142, 9.302132, 12.86276, 15.6028, 16.8101, 14.55905, 7.691915, 1.803458,
        1.073454},
       {9.628756, 13.60798, 13.07278, 8.442955, -10.74622, -14.71167, -7.312956}},
      {"periodic, .5, 1.25, linear, 1., 2.",
       std::make_shared<PeriodicDrive>(.5, 1.25, linear(1, 2)),
       {0, 1, 1.375, 1.5, 2, 2.5, 3.375, 1.5, 2.5, 1, 2},
       {}},
      {"meter, 1., 3., steps, 4",
       std::make_shared<MeterDrive>(1, 3, 4),
       {0, 0, 0, 0, 1, 1, 0, 1, 1, 1, 0},
       {}},
      {"meter, 1., forever",
       std::make_shared<MeterDrive>(1, kForever, 1),
       {0, 0, 0, 0, 1, 1, 1, 1, 1, 1, 1},
       {}},
      {"closest next, 1., 3., const, .3",
       listen(closest_next(1, 3, .3)),
       {0, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0},
       {}},
      {"sample and hold, time, closest next, 1., forever, const, .3, initial value, -7.",
       sample_and_hold(listen(closest_next(1, kForever, .3)), -7),
       {-7, -7, -7, -7, 1, 1, 1.625, 1.9375, 2.5, 2.8125, 3.4375},
       {}},
      {"sample and hold, time, const, 1., initial value, 3.",
       sample_and_hold(make_constant_drive(1), 3),
       {3, 0.5, 0.6875, 0.75, 1, 1.25, 1.6875, 2, 2.5, 3, 3.5},
       {}},
      {"sample and hold, time, meter, 0., forever, steps, 4, initial value, 5.",
       sample_and_hold(std::make_shared<MeterDrive>(0, kForever, 4), 5),
       {5, 0.5, 0.5, 0.75, 1, 1.25, 1.5, 2, 2.5, 3, 3.5},
       {}},
      {"discrete filter, 1, .5, .25, 1, .1, time",
       discrete_filter({.5}, .25, {.1}, linear(0, 1)),
       {0, 0.3064209, 0.4375214, 0.4812607, 0.6562507, 0.83125, 1.1375, 1.35625, 1.70625, 2.05625,
        2.40625},
       {}},
      {"scalar function, \"sf\"",
       std::make_shared<ScalarFunctionDrive>(spline({0, 1, 2, 3}, {0, 1, 0, 1})),
       {0, 1, 1.090332, 1.09375, 1, 0.78125, 0.2856445, 0, 0, 1, 2.666667},
       {1.958333, 0.8333333, -0.6666667, -1.041667, -0.6666667, 0.8333333, 3.333333}},
      {"direct", linear(0, 1), {0, 0.5, 0.6875, 0.75, 1, 1.25, 1.6875, 2, 2.5, 3, 3.5}, {}},
      {"file, 1, 1",
       std::make_shared<FileDrive>(file1(), 0, 1),
       {0, 1, 1.375, 1.5, 2, 2.5, 2.8125, 2.5, 2, 0, 0},
       {}},
      {"file, 1, 2, amplitude, 2.",
       std::make_shared<FileDrive>(file1(), 1, 2),
       {0, 20, 23.75, 25, 30, 35, 47.5, 60, 80, 0, 0},
       {}},
      {"file, 2, 1",
       std::make_shared<FileDrive>(file2(), 0, 1),
       {1, 1, 1.375, 1.5, 2, 2.5, 2.625, 2, 2, 2, 2},
       {}},
      {"sine, 1., 2., 3., -1, .5",
       sine(1, 2, 3, -1, .5),
       {0.5, 0.5, 0.5, 0.5, 0.5, 1.938277, 3.442679, 3.5, 3.5, 3.5, 3.5},
       {}},
  };
  for (int number = 0; number <= 56; ++number) {
    advance_to(number);
    const double t = state_.time;
    for (const Row& row : rows) {
      for (std::size_t k = 0; k < kTimes.size(); ++k) {
        if (kTimes[k] != t) continue;
        const double expected = row.values[k];
        EXPECT_NEAR(row.drive->value(context()), expected, allowance(expected))
            << row.deck << " at " << t;
      }
      for (std::size_t k = 0; k < row.derivatives.size(); ++k) {
        if (kDerivativeTimes[k] != t) continue;
        const double expected = row.derivatives[k];
        EXPECT_NEAR(derivative_in_time(*row.drive, context()), expected, allowance(expected))
            << row.deck << " at " << t;
      }
    }
  }
}

TEST_F(DriveTable, DerivativesAtKinksAreMeansOfOneSidedSlopes) {
  const std::vector<Row> rows = {
      {"ramp, 2., .25, .75, .5", ramp({2, .25, .75}, {0, 0, 0}, .5), {}, {0, 1, 2, 1, 0}},
      {"double ramp, 2., .25, .5, -1., .75, 1., .5",
       ramp({2, .25, .5}, {-1, .75, 1}, .5),
       {},
       {0, 1, 1, -0.5, -0.5}},
      {"piecewise linear, 3, .25,1., .5,2., .75,-1.",
       std::make_shared<PiecewiseLinearDrive>(std::vector<double>{.25, .5, .75},
                                              std::vector<double>{1, 2, -1}),
       {},
       {0, 2, -4, -6, 0}},
  };
  for (const Row& row : rows)
    for (std::size_t k = 0; k < row.derivatives.size(); ++k)
      EXPECT_NEAR(row.drive->derivative(context(), 0.25 * static_cast<double>(k)),
                  row.derivatives[k], 1e-12)
          << row.deck << " " << k;
}

TEST_F(DriveTable, ExtremesHaveTheSlopeOfTheDriveThatCounts) {
  const std::vector<DrivePtr> parts = {linear(1, 2), linear(4, -1), make_constant_drive(2.5)};
  const ExtremeDrive smallest(parts, false), largest(parts, true);
  const double t[] = {.5, 1.1, 3}, low[] = {2, 2.5, 1}, low_slope[] = {2, 0, -1},
               high[] = {3.5, 3.2, 7}, high_slope[] = {-1, 2, 2};
  for (int k = 0; k < 3; ++k) {
    EXPECT_DOUBLE_EQ(smallest.value(context(), t[k]), low[k]) << k;
    EXPECT_DOUBLE_EQ(largest.value(context(), t[k]), high[k]) << k;
    EXPECT_DOUBLE_EQ(smallest.derivative(context(), t[k]), low_slope[k]) << k;
    EXPECT_DOUBLE_EQ(largest.derivative(context(), t[k]), high_slope[k]) << k;
  }
  EXPECT_TRUE(smallest.has_derivative());
  EXPECT_FALSE(
      ExtremeDrive({linear(1, 2), std::make_shared<TimeStepDrive>()}, true).has_derivative());
}

TEST_F(DriveTable, SmoothDerivativesMatchCentralDifferences) {
  const std::vector<DrivePtr> drives = {
      std::make_shared<ExponentialDrive>(2, .5, 1, .25),
      std::make_shared<TanhDrive>(1, 2, 3, .25),
      std::make_shared<Step5Drive>(.5, -1, 2.5, 3),
      std::make_shared<FourierSeriesDrive>(.5, 2, 1, std::vector<double>{2, 4},
                                           std::vector<double>{3, 5}, 0, .5),
      std::make_shared<FrequencySweepDrive>(.5, linear(1, 2), linear(1, .5), .25, 3, -.75),
      std::make_shared<PeriodicDrive>(.5, 1.25, polynomial(1, 2, 3, 4)),
  };
  constexpr double e = 1e-5;
  for (std::size_t k = 0; k < drives.size(); ++k)
    for (const double t : {0.3, 1.1, 1.6, 2.2, 2.9}) {
      const double difference =
          (drives[k]->value(context(), t + e) - drives[k]->value(context(), t - e)) / (2 * e);
      EXPECT_NEAR(drives[k]->derivative(context(), t), difference,
                  1e-7 * std::max(1.0, std::abs(difference)))
          << k << " at " << t;
    }
}

TEST_F(DriveTable, DoubleRampForeverNeverEnds) {
  EXPECT_DOUBLE_EQ(ramp({2, 1, kForever}, {0, 0, 0}, .5)->value(context(), 101), 200.5);
}

TEST_F(DriveTable, FileDriversInterpolateAndPad) {
  SampleTable fixed;
  fixed.t0 = .5;
  fixed.values = {1, 3, 2};
  SampleTable counted = fixed;
  counted.t0 = .25;
  counted.dt = .5;
  TableOptions held;
  held.linear = held.pad_zeros = false;
  const std::vector<std::pair<FileDriverPtr, std::vector<double>>> rows = {
      {std::make_shared<TableDriver>(fixed, held), {1, 1, 1, 1, 1, 1, 3, 3, 3, 3, 2, 2, 2}},
      {file2(true, true), {0, 0, 0, 1.5, 2, 2.5, 3, 2.5, 0, 0, 0, 0, 0}},
      {file2(false, false), {1, 1, 1, 1, 1, 1, 3, 3, 2, 2, 2, 2, 2}},
      {std::make_shared<TableDriver>(counted, TableOptions{}),
       {0, 1, 2, 3, 2.5, 2, 0, 0, 0, 0, 0, 0, 0}},
  };
  for (std::size_t row = 0; row < rows.size(); ++row)
    for (std::size_t k = 0; k < rows[row].second.size(); ++k)
      EXPECT_NEAR(rows[row].first->value(context(), 0, 0.25 * static_cast<double>(k)),
                  rows[row].second[k], 1e-12)
          << row << " " << k;
}

TEST_F(DriveTable, BailoutEndsTheRun) {
  SampleTable t;
  t.values = {1, 3};
  TableOptions options;
  options.bail_upper = true;
  const TableDriver driver(t, options);
  EXPECT_EQ(driver.value(context(), 0, -1), 0);
  EXPECT_EQ(driver.value(context(), 0, 1), 3);
  EXPECT_THROW(driver.value(context(), 0, 1.1), EvaluationError);
}

TEST(SampleText, ReadsRowsCommentsAndHeader) {
  const SampleText s =
      parse_samples("# initial time: 0.25\n# time step: .5\n\n 1 -2e1\n+3,\t4 # comment\n5 6", 2);
  EXPECT_EQ(s.error, "");
  EXPECT_EQ(s.rows, 3);
  EXPECT_EQ(s.values, (std::vector<double>{1, -20, 3, 4, 5, 6}));
  EXPECT_EQ(s.initial_time, "0.25");
  EXPECT_EQ(s.time_step, ".5");
}

/// Decimal commas and columns that belong to no channel make other numbers of the same text.
TEST(SampleText, NamesTheLineThatDoesNotFit) {
  const auto error = [](const std::string& text) { return parse_samples(text, 2).error; };
  EXPECT_EQ(error("1 2\n# c\n3\n"), "line 3: 2 numbers expected");
  EXPECT_EQ(error("0,5 1,2\n"), "line 1: 2 numbers expected, then comes \"1,2\"");
  EXPECT_EQ(error("1 2\n3 4 5 6\n"), "line 2: 2 numbers expected, then comes \"5 6\"");
  EXPECT_EQ(error("1 2m\n"), "line 1: 2 numbers expected, then comes \"m\"");
  for (const char* word : {"nan", "inf", "-inf"})
    EXPECT_EQ(error("1 " + std::string(word)),
              "line 1: \"" + std::string(word) + "\" is no finite number");
}

TEST_F(DriveTable, MeterCountsStepsFromTheStart) {
  const MeterDrive late(1.03, kForever, 3), bounded(.3, 2, 3);
  const std::vector<double> late_values = {0, 0, 0, 0, 0, 0, 1, 0, 0, 1, 0, 0, 1};
  const std::vector<double> bounded_values = {0, 0, 0, 1, 0, 0, 1, 0, 0, 0, 0, 0, 0};
  for (int k = 0; k <= 12; ++k) {
    advance_to(k, 0.25);
    EXPECT_EQ(late.value(context(), 0), late_values[k]) << k;
    EXPECT_EQ(bounded.value(context(), 0), bounded_values[k]) << k;
  }
}

TEST_F(DriveTable, ClosestNextRefusesAnIncrementThatDoesNotAdvance) {
  listen(closest_next(0, kForever, 0));
  advance_to(0);
  advance_to(1);
  EXPECT_THROW(advance_to(2), EvaluationError);
}

TEST_F(DriveTable, DiscreteFilterSeesInputsOneStepNewer) {
  const DrivePtr filter = discrete_filter({.5}, .25, {.1}, linear(0, 1));
  const std::vector<double> expected = {0, 0.021875, 0.0546875, 0.09296875};
  for (int k = 0; k < 4; ++k) {
    advance_to(k);
    EXPECT_NEAR(filter->value(context()), expected[k], 1e-15) << k;
  }
}

TEST_F(DriveTable, RandomStaysInRangeAndHoldsForItsSteps) {
  const int memory = allocate(RandomDrive::kMemory, 5);
  state_.memory[memory + 1] = RandomDrive::seeded(1);
  const auto drive =
      listen(std::make_shared<RandomDrive>(memory, RandomDrive::Range{2, 5, 1, 50, 4}));
  double previous = 5, sum = 0;
  int changes = 0;
  for (int k = 0; k <= 900; ++k) {
    advance_to(k);
    const double v = drive->value(context(), 0);
    EXPECT_LE(std::abs(v - 5), 2);
    if (state_.time < 1 || state_.time > 50) {
      EXPECT_EQ(v, 5);
    } else if (k % 4 != 0) {
      EXPECT_EQ(v, previous);
    } else {
      ++changes;
    }
    sum += v - 5;
    previous = v;
  }
  EXPECT_EQ(changes, 197);
  EXPECT_LT(std::abs(sum / 785), 0.3);
}

/// Not with the first multiple of its steps.
TEST_F(DriveTable, RandomBeginsWithItsTime) {
  const int memory = allocate(RandomDrive::kMemory, 5);
  state_.memory[memory + 1] = RandomDrive::seeded(1);
  const auto drive =
      listen(std::make_shared<RandomDrive>(memory, RandomDrive::Range{2, 5, 1.03, 50, 40}));
  std::vector<double> values;
  for (int k = 0; k <= 40; ++k) {
    advance_to(k);
    const double v = drive->value(context(), 0);
    if (state_.time < 1.03) {
      EXPECT_EQ(v, 5);
    } else if (values.empty() || v != values.back()) {
      values.push_back(v);
    }
  }
  ASSERT_EQ(values.size(), 2u);  // at once, and at step 40
  EXPECT_NE(values[0], 5);
}

TEST_F(DriveTable, RandomRepeatsFromACopiedState) {
  const int memory = allocate(RandomDrive::kMemory, 0);
  state_.memory[memory + 1] = RandomDrive::seeded(7);
  const auto drive =
      listen(std::make_shared<RandomDrive>(memory, RandomDrive::Range{1, 0, 0, kForever, 1}));
  advance_to(1);
  const State saved = state_;
  advance_to(2);
  const double first = drive->value(context(), 0);
  state_ = saved;
  advance_to(2);
  EXPECT_EQ(drive->value(context(), 0), first);
}

TEST_F(DriveTable, BistopRemembers) {
  const int memory = allocate(BistopDrive::kMemory, 0);
  const auto drive = listen(
      std::make_shared<BistopDrive>(memory, step(.5, kForever, 1, 0), step(1, kForever, 1, 0)));
  advance_to(8);
  EXPECT_EQ(drive->value(context(), 0), 1);
  advance_to(17);
  EXPECT_EQ(drive->value(context(), 0), 0);
}

/// Numbers of steps of the reference solver's `drive caller: 10, closest next, t0, forever, …,
/// output, yes`.
TEST_F(DriveTable, ClosestNextLosesTheInstantsWithinTheStepAfter) {
  const auto fires = [&](double t0, DrivePtr increment) {
    listeners_.clear();
    return steps_of(*listen(closest_next(t0, kForever, std::move(increment))), 18);
  };
  const std::vector<int> odd{0, 1, 3, 5, 7, 9, 11, 13, 15, 17};
  EXPECT_EQ(fires(0, make_constant_drive(.01)), odd);
  EXPECT_EQ(fires(0, make_constant_drive(.0625)), odd);
  EXPECT_EQ(fires(0, make_constant_drive(.1)), (std::vector<int>{0, 1, 4, 7, 10, 12, 15, 18}));
  EXPECT_EQ(fires(0, make_constant_drive(.125)),
            (std::vector<int>{0, 1, 4, 6, 8, 10, 12, 14, 16, 18}));
  EXPECT_EQ(fires(.0625, make_constant_drive(.1)), (std::vector<int>{1, 3, 5, 8, 11, 13, 16}));
  EXPECT_EQ(fires(.3, linear(.1, .1)), (std::vector<int>{5, 7, 10, 13, 16}));
  EXPECT_EQ(fires(.3, linear(0, 1)), (std::vector<int>{5, 11}));
}

/// The reference solver's `discrete filter, 2, .5, -.2, .3, 2, .1, .05, const, 1.`.
TEST_F(DriveTable, DiscreteFilterStartsWithoutTheInitialInput) {
  const auto filter = discrete_filter({.5, -.2}, .3, {.1, .05}, make_constant_drive(1));
  const std::vector<double> values{.3, .55, .665, .6725, .65325, .642125};
  for (int number = 0; number < 6; ++number) {
    advance_to(number);
    EXPECT_NEAR(filter->value(context()), values[number], 1e-12) << number;
  }
}

/// A degree of freedom that a step changes.
class Unknown : public Drive {
 public:
  using Drive::value;
  double value(const EvalContext& context, double) const override { return context.state->y[0]; }
};

/// As the reference solver's `discrete filter, 1, 1., 1., 1, 0.`, which sums the velocities of a
/// node at the ends of the steps, and `1, 0., 0., 1, 1.`, which gives those of the starts.
TEST_F(DriveTable, DiscreteFilterSeesThePresentInput) {
  const auto input = std::make_shared<Unknown>();
  const auto sum = discrete_filter({1}, 1, {0}, input),
             delayed = discrete_filter({0}, 0, {1}, input);
  state_.y = {0};
  advance_to(0);
  const std::vector<double> velocities{-.00143057, -.00343814, -.00588541};
  double expected_sum = 0, before = 0;
  for (int number = 1; number <= 3; ++number) {
    advance_to(number);  // with the unknown of the step before
    state_.y = {velocities[number - 1]};
    for (const auto& listener : listeners_) listener->after_convergence(context(), state_);
    expected_sum += state_.y[0];
    EXPECT_NEAR(sum->value(context()), expected_sum, 1e-12) << number;
    EXPECT_NEAR(delayed->value(context()), before, 1e-12) << number;
    before = state_.y[0];
  }
}

/// Where an argument is given, the history is still that of the input in time.
TEST_F(DriveTable, DiscreteFilterTakesAnArgumentForThePresentInputAlone) {
  const auto filter = discrete_filter({.5}, .3, {.1}, linear(0, 1));
  for (int number = 0; number <= 2; ++number) advance_to(number, 1);
  EXPECT_NEAR(filter->value(context()), .3 * 2 + .5 * (.3 + .1) + .1 * 2, 1e-12);
  EXPECT_NEAR(filter->value(context(), 7), .3 * 7 + .5 * (.3 + .1) + .1 * 2, 1e-12);
}

/// As `drive, …, const, .3`.
TEST_F(DriveTable, ArgumentsReplaceTheTime) {
  advance_to(8);
  const auto at_argument = [&](DrivePtr f) {
    return ChainDrive(std::move(f), make_constant_drive(.3)).value(context());
  };
  const DrivePtr time = linear(0, 1), timestep = std::make_shared<TimeStepDrive>();
  EXPECT_EQ(at_argument(timestep), .3);
  EXPECT_EQ(timestep->value(context()), .0625);
  EXPECT_EQ(at_argument(std::make_shared<FileDrive>(file2(), 0, 1)), 1);
  advance_to(12);
  EXPECT_EQ(at_argument(std::make_shared<FileDrive>(file2(), 0, 1)), 1.5);
  EXPECT_EQ(PeriodicDrive(0, .5, std::make_shared<FileDrive>(file2(), 0, 1)).value(context()), 1.5);
  const ChainDrive chain(std::make_shared<ProductDrive>(time, time), linear(.1, .2));
  EXPECT_NEAR(chain.value(context()), .0625, 1e-15);
  EXPECT_NEAR(derivative_in_time(chain, context()), 2 * .25 * .2, 1e-15);
}

TEST_F(DriveTable, PostponedFollowsTheDriveCallerDeclaredLater) {
  Model model;
  const PostponedDrive drive(7);
  EvalContext c = context();
  c.model = &model;
  EXPECT_THROW(drive.value(c, 2), EvaluationError);
  model.drives.push_back({7, "", linear(1, 2), false, false});
  model.drive_index[7] = 0;
  EXPECT_EQ(drive.value(c, 2), 5);
  EXPECT_EQ(drive.derivative(c, 2), 2);
}

TEST_F(DriveTable, PostponedDrivesInACircleAreRefused) {
  Model model;
  const auto drive = std::make_shared<PostponedDrive>(7);
  model.drives.push_back(
      {7, "", std::make_shared<ProductDrive>(drive, linear(1, 2)), false, false});
  model.drive_index[7] = 0;
  EvalContext c = context();
  c.model = &model;
  EXPECT_THROW(drive->value(c), EvaluationError);
  EXPECT_THROW(drive->value(c), EvaluationError);
}

}  // namespace
}  // namespace mbcosim::drives_test
