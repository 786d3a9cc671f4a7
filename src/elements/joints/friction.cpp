#include "elements/joints/friction.h"

namespace mbcosim {

namespace {

/// [m/s²] A scale of accelerations, for the velocity that a sticking contact could take up in a
/// step.
constexpr double kUsualAcceleration = 10;

double read_coefficient(Card& card, const char* model, const char* what) {
  const double value = card.real(what);
  if (!(value >= 0)) card.fail(std::string(model) + " friction: " + what + " must not be negative");
  return value;
}

void read_modlugre(Card& card, Friction& f) {
  f.sigma0 = read_coefficient(card, "modlugre", "sigma 0");
  if (f.sigma0 == 0) card.fail("modlugre friction: sigma 0 must be positive");
  f.sigma1 = read_coefficient(card, "modlugre", "sigma 1");
  f.sigma2 = read_coefficient(card, "modlugre", "sigma 2");
  f.kappa = read_coefficient(card, "modlugre", "kappa");
  if (f.kappa > 1)
    card.fail("modlugre friction: kappa must not be larger than 1",
              "bristles that stay elastic up to more than the limit never slide");
  f.steady = card.scalar_function("friction function");
}

void read_discrete_coulomb(Card& card, Friction& f) {
  f.law = Friction::Law::discrete_coulomb;
  f.steady = card.scalar_function("friction function");
  if (f.steady->value(0) < 0)
    card.fail("discrete coulomb friction: the friction function is negative at rest",
              "give the magnitude of the friction coefficient by the sliding speed");
  if (card.keyword("sigma2")) f.sigma2 = read_coefficient(card, "discrete coulomb", "sigma2");
  if (card.keyword("velocity ratio")) {
    f.velocity_ratio = card.real("velocity ratio");
    if (!(f.velocity_ratio > 0 && f.velocity_ratio <= 1))
      card.fail("discrete coulomb friction: the velocity ratio must lie in (0, 1]");
  }
}

Friction read_law(Card& card) {
  Friction f;
  if (card.keyword("preload")) {
    f.preload = card.real("preload");
    if (!(f.preload >= 0)) card.fail("the preload of friction must not be negative");
  }
  if (card.required("friction model", {"modlugre", "discrete coulomb"}) == 0)
    read_modlugre(card, f);
  else
    read_discrete_coulomb(card, f);
  return f;
}

}  // namespace

double Friction::coefficient_now(const Local<double>& u, int own, const Contact<double>& k) const {
  if (law == Law::modlugre) return bristles(u, own, k);
  if (!(k.N > 0)) return 0;
  const double q = u.own(own) / k.N;
  if (shape == Shape::simple) return q;
  if (shape == Shape::plane_hinge) return q / std::sqrt(std::max(1 - q * q, 1e-12));
  return q / (thread_gain - q * thread_slope * k.axial_sign);
}

void Friction::start(Start& s, int from, double v) const {
  if (law == Law::modlugre) return;
  // Reactions are unknown yet: what moves slides, what rests is judged by its load.
  constexpr double kResting = 1e3, kMoving = 1e9;
  s.memory(from) = v == 0 ? kResting : kMoving / std::abs(v);
  s.memory(from + 1) = v;
}

void Friction::after_convergence(const Local<double>& u, State& state, int own, int from,
                                 const Contact<double>& k) const {
  if (law == Law::modlugre) return;
  double* memory = &state.memory[u.memory_offset() + from];
  const double f = sliding_coefficient(k.v);
  const double limit = std::max(coefficient(f, k.axial_sign), -coefficient(-f, k.axial_sign)) * k.N;
  const double usual = kUsualAcceleration * u.context->h;
  const bool slides = std::abs(k.v) > 1e-3 * usual;
  const double scale = slides ? std::max(std::abs(k.v), std::abs(k.v - memory[1])) : usual;
  if (limit > 0 && scale > 0) memory[0] = velocity_ratio * limit / scale;
  memory[1] = k.v;
  memory[2] = u.own(own);
}

Friction read_friction(Card& card) {
  Friction f = read_law(card);
  if (card.keyword("screw joint"))
    card.fail("shape function `screw joint` belongs to the joint `screw`",
              "use `simple` or `simple plane hinge`");
  f.shape = card.required("shape function", {"simple", "simple plane hinge"}) == 0
                ? Friction::Shape::simple
                : Friction::Shape::plane_hinge;
  return f;
}

Friction read_thread_friction(Card& card, double lead, double& radius) {
  Friction f = read_law(card);
  if (!card.keyword("screw joint"))
    card.fail_at(card.next(), "the friction of a screw needs the shape function `screw joint`",
                 "give `screw joint, radius, <r>, half thread angle, <angle>`");
  f.shape = Friction::Shape::thread;
  (void)card.required("argument of `screw joint`", {"radius"});
  radius = card.real("mean radius of the thread");
  if (!(radius > 0)) card.fail("screw: the mean radius of the thread must be positive");
  (void)card.required("argument of `screw joint`", {"half thread angle"});
  const double angle = card.real("half thread angle");
  if (!(std::abs(angle) < kPi / 2))
    card.fail("screw: the half thread angle must lie between -pi/2 and pi/2",
              "give half the angle between the flanks, in radians");
  const double slope = lead / radius;
  f.thread_gain = (1 + slope * slope) / std::cos(angle);
  f.thread_slope = slope / std::cos(angle);
  if (!(f.steady->value(0) * std::abs(f.thread_slope) < 1))
    card.fail("screw: the thread jams: friction times the slope of the thread is not below 1",
              "reduce the friction or the pitch, or enlarge the radius");
  return f;
}

}  // namespace mbcosim
