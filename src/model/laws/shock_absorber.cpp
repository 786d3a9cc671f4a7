// Gas spring with an oil orifice: landing gear shock absorber.
#include <cmath>

#include "math/dual.h"
#include "model/laws/law_parts.h"

namespace mbcosim {

namespace {

/// Area as a function of the strain or of its rate, with another one for negative rates.
struct Area {
  DrivePtr positive, negative;

  /// Value and derivative with respect to `x`.
  template <class T>
  T operator()(const EvalContext& context, const T& x, bool negative_rate) const {
    const DrivePtr& d = negative_rate && negative ? negative : positive;
    if (!d) return T(0.0);
    const double at = value_of(x);
    if constexpr (std::is_same_v<T, double>)
      return d->value(context, at);
    else
      return x.chain(d->value(context, at), slope(*d, context, at));
  }

 private:
  /// At a jump of the area, where a drive has no derivative, that of the value there.
  static double slope(const Drive& d, const EvalContext& context, double x) {
    if (d.has_derivative()) try {
        return d.derivative(context, x);
      } catch (const EvaluationError&) {
        return 0;
      }
    const double h = 1e-6 * std::max(1.0, std::abs(x));
    return (d.value(context, x + h) - d.value(context, x - h)) / (2 * h);
  }
};

/// Shock absorber (MBDyn input manual, "shock absorber"), e = ε − ε₀(t):
///
///   p  = P₀ (1 + C e)^−γ                                          gas pressure [Pa]
///   Fe = −A₀ p + end stops with their damping                     gas, penalty [N]
///   Fv = ½ ρ A_f (A_f / (A C_d))² ε̇ |ε̇|                           oil [N]
///   A  = metering(e) + orifice(ε̇)                                 orifice area [m²]
///   f  = Fe + Fv + A₀ p a tanh(ε̇/v)                               the last: friction [N]
struct ShockAbsorberData {
  double pressure, area, interaction, gamma;  ///< P₀, A₀, C, γ
  double max = 0, min = -0.5;                 ///< strains at the end stops
  double penalty = 1e9, penalty_damping = 0;
  Area metering, orifice;
  double fluid_area, density, discharge;       ///< A_f, ρ, C_d
  double friction_velocity = 1, friction = 0;  ///< v, a
};

template <class T>
struct ShockAbsorberForces {
  T p, A, elastic, viscous, friction;
  T total() const { return elastic + friction + viscous; }
};

template <class T>
ShockAbsorberForces<T> shock_absorber_forces(const ShockAbsorberData& d, const EvalContext& context,
                                             const T& e, const T& rate) {
  using std::abs;
  using std::pow;
  using std::tanh;
  const T gas = e * d.interaction + 1.0;
  if (!(value_of(gas) > 0)) throw EvaluationError("shock absorber: the gas volume vanished");
  ShockAbsorberForces<T> r;
  const bool negative = value_of(rate) < 0;
  r.p = pow(gas, -d.gamma) * d.pressure;
  r.A = d.metering(context, e, negative) + d.orifice(context, rate, negative);
  if (!(value_of(r.A) > 0))
    throw EvaluationError("shock absorber: the orifice area must be positive");
  r.elastic = -(r.p * d.area);
  r.friction = r.p * d.area * tanh(rate / d.friction_velocity) * d.friction;
  const T ratio = T(d.fluid_area / d.discharge) / r.A;
  r.viscous = ratio * ratio * rate * abs(rate) * (0.5 * d.density * d.fluid_area);
  if (value_of(e) > d.max) {
    r.elastic += (e - d.max) * d.penalty;
    if (value_of(rate) > 0) r.elastic += rate * d.penalty_damping;
  } else if (value_of(e) < d.min) {
    r.elastic += (e - d.min) * d.penalty;
    if (value_of(rate) < 0) r.elastic += rate * d.penalty_damping;
  }
  return r;
}

class ShockAbsorber : public Law<1> {
 public:
  ShockAbsorber(ShockAbsorberData data, Prestress<1> pre)
      : data_(std::move(data)), pre_(std::move(pre)) {}
  LawType type() const override { return LawType::viscoelastic; }
  void respond(const EvalContext& context, const V& strain, const V& rate, bool tangent,
               Response& r) const override {
    const double e = pre_.reduced(context, strain)(0);
    if (!tangent) {
      r.f(0) = shock_absorber_forces<double>(data_, context, e, rate(0)).total();
      return;
    }
    using D = Dual<2>;
    const auto s =
        shock_absorber_forces<D>(data_, context, D::variable(e, 0), D::variable(rate(0), 1));
    const D f = s.total();
    r.f(0) = f.v;
    r.de(0) = f.d[0];
    r.dep(0) = f.d[1];
  }

  int output_size() const override { return 4; }
  void output(const EvalContext& context, const V& strain, const V& rate,
              double* values) const override {
    const auto s =
        shock_absorber_forces<double>(data_, context, pre_.reduced(context, strain)(0), rate(0));
    values[0] = s.p;
    values[1] = s.A;
    values[2] = s.elastic;
    values[3] = s.viscous;
  }
  int private_datum(const std::string& name) const override {
    constexpr const char* names[] = {"p", "A", "Fe", "Fv"};
    for (int i = 0; i < 4; ++i)
      if (name == names[i]) return i;
    return -1;
  }

 private:
  ShockAbsorberData data_;
  Prestress<1> pre_;
};

Area read_area(Card& card, std::string_view what) {
  Area a;
  a.positive = card.drive(what);
  if (card.keyword("negative")) a.negative = card.drive(what);
  return a;
}

LawPtr<1> read_shock_absorber(Card& card) {
  Prestress<1> pre;
  if (card.keyword("prestrain")) pre.strain = card.scalar_template_drive("prestrain");
  ShockAbsorberData d;
  (void)card.keyword("help");  // asks the reference solver to print the syntax
  d.pressure = card.real("reference pressure");
  d.area = card.real("reference area");
  d.interaction = card.real("interaction coefficient");
  d.gamma = card.real("polytropic exponent");
  if (card.keyword("epsilon max")) d.max = card.real("maximum strain");
  if (card.keyword("epsilon min")) d.min = card.real("minimum strain");
  if (d.min >= d.max) card.fail("shock absorber: `epsilon min` must be below `epsilon max`");
  if (card.keyword("penalty")) {
    d.penalty = card.real("penalty stiffness");
    d.penalty_damping = card.real("penalty damping");
  }
  if (card.keyword("metering")) d.metering = read_area(card, "metering area");
  if (card.keyword("orifice")) d.orifice = read_area(card, "orifice area");
  if (!d.metering.positive && !d.orifice.positive)
    card.fail_expected("shock absorber: `metering` or `orifice` expected",
                       "without an area no fluid can pass");
  d.fluid_area = card.real("fluid area");
  d.density = card.real("fluid density");
  d.discharge = card.real("discharge coefficient");
  if (d.discharge == 0) card.fail("shock absorber: the discharge coefficient must not be null");
  if (card.keyword("friction")) {
    d.friction_velocity = card.real("friction reference velocity");
    if (d.friction_velocity == 0)
      card.fail("shock absorber: the friction reference velocity must not be null");
    d.friction = card.real("friction amplitude");
    if (d.friction < 0 || d.friction > 1)
      card.fail("shock absorber: the friction amplitude must lie between 0 and 1, got " +
                std::to_string(d.friction));
  }
  return std::make_shared<ShockAbsorber>(std::move(d), std::move(pre));
}

}  // namespace

void register_shock_absorber(Registry& r) { r.law1({"shock absorber"}, read_shock_absorber); }

}  // namespace mbcosim
