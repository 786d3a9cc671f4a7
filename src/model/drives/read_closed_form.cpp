#include <array>

#include "model/drives/closed_form_drives.h"
#include "model/drives/oscillating_drives.h"
#include "model/drives/readers.h"

namespace mbcosim {

namespace {

Registry::DriveReader polynomial(int coefficients) {
  return [coefficients](Card& card) -> DrivePtr {
    std::array<double, 4> c{};
    for (int k = 0; k < coefficients; ++k) c[k] = card.real("coefficient");
    return std::make_shared<PolynomialDrive>(c);
  };
}

Registry::DriveReader constant(double value) {
  return [value](Card&) { return make_constant_drive(value); };
}

DrivePtr read_step(Card& card) {
  const double t0 = card.real("time of the step"), s = card.real("height"),
               i = card.real("initial value");
  return std::make_shared<StepDrive>(t0, std::numeric_limits<double>::infinity(), s, i);
}

DrivePtr read_double_step(Card& card) {
  const double t0 = card.real("time of the first step"), t1 = read_end(card);
  if (!(t1 > t0)) card.fail("double step: the second step must come after the first");
  const double s = card.real("height"), i = card.real("initial value");
  return std::make_shared<StepDrive>(t0, t1, s, i);
}

/// slope, start, end
DoubleRampDrive::Slope read_slope(Card& card, double slope, double start) {
  const double end = read_end(card);
  if (!(end > start))
    card.fail("ramp: it ends at " + std::to_string(end) + ", which is not after its start " +
              std::to_string(start));
  return {slope, start, end};
}

DrivePtr read_ramp(Card& card) {
  const double a = card.real("slope"), t0 = card.real("initial time");
  const DoubleRampDrive::Slope up = read_slope(card, a, t0);
  return std::make_shared<DoubleRampDrive>(up, DoubleRampDrive::Slope{0, 0, 0},
                                           card.real("initial value"));
}

DrivePtr read_double_ramp(Card& card) {
  const double a = card.real("ascending slope"), t0 = card.real("ascending initial time");
  const DoubleRampDrive::Slope up = read_slope(card, a, t0);
  const double d = card.real("descending slope"), t2 = read_end(card);
  if (t2 < up.end) card.fail("double ramp: the second ramp starts before the first one ends");
  DoubleRampDrive::Slope down{0, 0, 0};
  if (t2 < std::numeric_limits<double>::infinity())
    down = read_slope(card, d, t2);
  else
    read_end(card);  // the second ramp never starts
  return std::make_shared<DoubleRampDrive>(up, down, card.real("initial value"));
}

DrivePtr read_piecewise_linear(Card& card) {
  const int n = read_count(card, "number of points", 2);
  std::vector<double> x, y;
  for (int k = 0; k < n; ++k) {
    x.push_back(card.real("abscissa"));
    if (k > 0 && !(x[k] > x[k - 1]))
      card.fail("piecewise linear: abscissa " + std::to_string(x[k]) +
                " does not exceed the one before, " + std::to_string(x[k - 1]));
    y.push_back(card.real("ordinate"));
  }
  return std::make_shared<PiecewiseLinearDrive>(std::move(x), std::move(y));
}

/// `half`, `one`, `forever` or a number of cycles.
int read_cycles(Card& card) {
  switch (card.one_of({"half", "one", "forever"})) {
    case 0:
      return -1;
    case 1:
      return 1;
    case 2:
      return 0;
    default:
      return card.integer("number of cycles (or `half`, `one`, `forever`)");
  }
}

double read_omega(Card& card) {
  const double omega = card.real("angular frequency");
  if (omega == 0) card.fail("the angular frequency must not be zero");
  return omega;
}

template <class D>
DrivePtr read_oscillation(Card& card) {
  const double t0 = card.real("initial time"), omega = read_omega(card), a = card.real("amplitude");
  const int cycles = read_cycles(card);
  return std::make_shared<D>(t0, omega, a, cycles, card.real("initial value"));
}

DrivePtr read_fourier_series(Card& card) {
  const double t0 = card.real("initial time"), omega = read_omega(card);
  const int n = read_count(card, "number of harmonics");
  const double a0 = card.real("a0");
  std::vector<double> a, b;
  for (int k = 0; k < n; ++k) {
    a.push_back(card.real("cosine coefficient"));
    b.push_back(card.real("sine coefficient"));
  }
  const int cycles = read_cycles(card);
  if (cycles < 0)
    card.fail("fourier series: the number of cycles must be positive, `one` or `forever`");
  return std::make_shared<FourierSeriesDrive>(t0, omega, a0, std::move(a), std::move(b), cycles,
                                              card.real("initial value"));
}

DrivePtr read_frequency_sweep(Card& card) {
  const double t0 = card.real("initial time");
  DrivePtr omega = card.drive("angular frequency");
  DrivePtr amplitude = card.drive("amplitude");
  const double i = card.real("initial value"), tf = read_end(card), f = card.real("final value");
  return std::make_shared<FrequencySweepDrive>(t0, std::move(omega), std::move(amplitude), i, tf,
                                               f);
}

DrivePtr read_exponential(Card& card) {
  const double a = card.real("amplitude"), tau = card.real("time constant");
  if (tau == 0) card.fail("exponential: the time constant must not be zero");
  const double t0 = card.real("initial time");
  return std::make_shared<ExponentialDrive>(a, tau, t0, card.real("initial value"));
}

DrivePtr read_tanh(Card& card) {
  const double t0 = card.real("initial time"), a = card.real("amplitude"), b = card.real("slope");
  return std::make_shared<TanhDrive>(t0, a, b, card.real("initial value"));
}

DrivePtr read_step5(Card& card) {
  const double t0 = card.real("initial time"), y0 = card.real("initial value"),
               t1 = card.real("final time");
  if (!(t1 > t0)) card.fail("step5: the final time must exceed the initial one");
  return std::make_shared<Step5Drive>(t0, y0, t1, card.real("final value"));
}

}  // namespace

void register_closed_form_drives(Registry& registry) {
  registry.drive({"null"}, constant(0));
  registry.drive({"unit", "one"}, constant(1));
  registry.drive({"const"}, [](Card& card) { return make_constant_drive(card.real("value")); });
  registry.drive({"timestep"}, [](Card&) { return std::make_shared<TimeStepDrive>(); });
  registry.drive({"time", "direct"}, [](Card&) {
    return std::make_shared<PolynomialDrive>(std::array<double, 4>{0, 1, 0, 0});
  });
  registry.drive({"linear"}, polynomial(2));
  registry.drive({"parabolic"}, polynomial(3));
  registry.drive({"cubic"}, polynomial(4));
  registry.drive({"step"}, read_step);
  registry.drive({"double step"}, read_double_step);
  registry.drive({"ramp"}, read_ramp);
  registry.drive({"double ramp"}, read_double_ramp);
  registry.drive({"piecewise linear"}, read_piecewise_linear);
  registry.drive({"sine"}, read_oscillation<SineDrive>);
  registry.drive({"cosine"}, read_oscillation<CosineDrive>);
  registry.drive({"fourier series"}, read_fourier_series);
  registry.drive({"frequency sweep"}, read_frequency_sweep);
  registry.drive({"exponential"}, read_exponential);
  registry.drive({"tanh"}, read_tanh);
  registry.drive({"step5"}, read_step5);
}

}  // namespace mbcosim
