#include "elements/user/wheel.h"

#include <limits>

#include "elements/read_number.h"

namespace mbcosim {

namespace {

template <class T>
T magnitude(const T& x) {
  return value_of(x) < 0 ? T(-x) : x;
}
template <class T>
T length_of(const Vec<T>& v) {
  using std::sqrt;
  const T square = v.dot(v);
  return value_of(square) > 0 ? T(sqrt(square)) : T(0.0);
}

constexpr const char* kWheelGrammar =
    "wheel2, <wheel node>, <axle>, <ground node>, <point>, <normal>, <radius>, <tyre radius>, "
    "<volume coefficient>, <pressure>, <exponent>, <hysteresis velocity> [, slip, <mu_x0>, "
    "<mu_y0>, <mu_y1> [, threshold, <velocity>, <velocity>]]";

}  // namespace

double Wheel::reference_area() const { return 3.7 * r0 * std::sqrt(r0 * (2 * R0 - r0)); }
double Wheel::volume() const { return 2 * kPi * (R0 - r0) * kPi * r0 * r0 * Vc; }

template <class T>
T Wheel::normal_force(const Patch<T>& c) const {
  using std::pow;
  using std::tanh;
  const T area = c.depth * (reference_area() / r0);
  const T rest = T(volume()) - area * c.depth * 0.5;
  if (!(value_of(rest) > 0))
    throw EvaluationError("wheel2: the tyre is pressed flat (depth " +
                          std::to_string(value_of(c.depth)) + " m)");
  const T pressure = pow(T(volume()) / rest, gamma) * p0;
  return area * pressure * (T(1.0) - tanh(c.v_n * (1 / v_h)));
}

template <class T>
void Wheel::add_slip(const Local<T>& u, const T& F_n, Patch<T>& c) const {
  using std::atan2;
  using std::tanh;
  const Vec<T> axis = u.R(0) * axle.cast<T>();
  Vec<T> f = axis.cross(c.n);
  if (value_of(f.dot(f)) < std::numeric_limits<double>::epsilon())
    throw EvaluationError("wheel2: the axle is normal to the ground");
  f = f / length_of(f);
  const Vec<T> l = c.n.cross(f);
  const T v_x = f.dot(c.v), v_ax = f.dot(c.v_a), v_ay = l.dot(c.v_a);
  const T reach = magnitude(v_ax) + v_t;
  if (value_of(v_x) != 0) c.s = value_of(reach) > 0 ? T(magnitude(v_x) / reach) : T(1.0);
  if (value_of(c.s) > 1) c.s = T(1.0);
  if (value_of(v_ax) != 0 || value_of(v_ay) != 0) c.alpha = atan2(v_ay, magnitude(v_ax));
  if (alpha_t > 0) {
    const T fade = tanh(length_of(Vec<T>(v_ax, v_ay, T(0.0))) * (1 / alpha_t));
    c.alpha = c.alpha * fade * fade;
  }
  const double sign = value_of(v_x) < 0 ? -1 : 1;
  c.mu_x =
      value_at(*mu_x0, *u.context, c.s) * sign * (T(1.0) - magnitude(c.alpha) * (1 / (kPi / 2)));
  c.F -= f * T(c.mu_x * F_n);
  if (value_of(v_ay) == 0) return;
  const T side = value_at(*mu_y0, *u.context, c.alpha);
  c.mu_y = side + (value_at(*mu_y1, *u.context, c.alpha) - side) * c.s;
  c.F -= l * T(c.mu_y * F_n);
}

template <class T>
Wheel::Patch<T> Wheel::patch(const Local<T>& u) const {
  Patch<T> c;
  c.s = c.alpha = c.mu_x = c.mu_y = c.v_n = T(0.0);
  c.F = c.v = c.v_a = c.arm = Vec<T>::Constant(T(0.0));
  c.n = u.R(1) * N.cast<T>();
  c.depth = T(R0 + P.dot(N)) - (u.x(0) - u.x(1)).dot(c.n);
  c.touches = value_of(c.depth) >= 0;
  if (!c.touches) {
    c.rho = T(R0);
    c.depth = T(0.0);
    return c;
  }
  c.rho = T(R0) - c.depth;
  c.arm = c.n * T(-c.rho);
  c.v_a = u.v(0) - u.v(1) - u.w(1).cross(u.R(1) * P.cast<T>());
  c.v = c.v_a + u.w(0).cross(c.arm);
  c.v_n = c.n.dot(c.v);
  const T F_n = normal_force(c);
  c.F = c.n * F_n;
  if (mu_x0) add_slip(u, F_n, c);
  return c;
}

void Wheel::after_convergence(const Local<double>& u, State& state) const {
  const Patch<double> c = patch(u);
  if (c.touches) state.memory[u.memory_offset()] = c.v_n;
}

void Wheel::output(const Local<double>& u, OutputRow& row) const {
  const Patch<double> c = patch(u);
  row.begin(OutputFile::usr, u.label());
  row.vec3("F", "N", c.F);
  row.vec3("M", "N m", c.arm.cross(c.F));
  row.scalar("rho", "m", c.rho);
  row.scalar("depth", "m", c.depth);
  row.scalar("vn", "m/s", c.touches ? c.v_n : u.memory(0));
  row.scalar("slip", "", c.s);
  row.scalar("alpha", "deg", c.alpha * kDegrees);
  row.scalar("mux", "", c.mu_x);
  row.scalar("muy", "", c.mu_y);
  row.scalar("va", "m/s", (c.v_a - c.n * c.n.dot(c.v_a)).norm());
  row.scalar("v", "m/s", (c.v - c.n * c.v_n).norm());
  row.end();
}

template Wheel::Patch<double> Wheel::patch(const Local<double>&) const;
template Wheel::Patch<Dual<12>> Wheel::patch(const Local<Dual<12>>&) const;

void read_wheel(Card& card, ElementInfo& info) {
  read_help(card, kWheelGrammar);
  Wheel e;
  e.wheel = card.structural_node();
  e.axle = card.relative_vector("axle", e.wheel);
  e.ground = card.structural_node();
  e.P = card.relative_position("point of the ground", e.ground);
  e.N = card.relative_vector("normal of the ground", e.ground);
  if (!(e.N.squaredNorm() > std::numeric_limits<double>::epsilon()))
    card.fail("the normal of the ground is null", "give the direction that points to the wheel");
  e.N.normalize();
  e.R0 = read_positive(card, "radius of the wheel");
  e.r0 = read_positive(card, "radius of the tyre");
  if (!(e.r0 < e.R0))
    card.fail("the radius of the tyre, " + std::to_string(e.r0) +
              ", must be less than that of the wheel, " + std::to_string(e.R0));
  e.Vc = read_positive(card, "volume coefficient");
  e.p0 = read_positive(card, "pressure");
  e.gamma = read_positive(card, "polytropic exponent");
  e.v_h = read_positive(card, "hysteresis velocity");
  if (card.keyword("slip")) {
    e.mu_x0 = card.drive("longitudinal friction");
    e.mu_y0 = card.drive("lateral friction without slip");
    e.mu_y1 = card.drive("lateral friction at full slip");
    if (card.keyword("threshold")) {
      e.v_t = card.real("velocity threshold");
      if (!(e.v_t >= 0)) card.fail("the velocity threshold must not be negative");
      e.alpha_t = card.real("threshold of the side slip");
    }
  }
  add_element(card.builder(), info, std::move(e));
}

}  // namespace mbcosim
