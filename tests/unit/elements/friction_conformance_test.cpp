/// Joints with friction, brake, screw and total equation in the conformance suite.
#include "elements/conformance.h"
#include "elements/joints/friction_joints.h"
#include "elements/joints/screw.h"
#include "elements/joints/total_equation.h"
#include "model/drive.h"
#include "model/scalar_function.h"

namespace mbcosim::conformance::friction_conformance_test {
namespace {

/// Steady friction that falls with the speed.
class Falling : public ScalarFunction {
 public:
  double value(double x) const override { return .3 + .3 / (1 + x * x); }
  double derivative(double x) const override { return -.6 * x / ((1 + x * x) * (1 + x * x)); }
};

Friction friction(Friction::Shape shape) {
  Friction f;
  f.sigma0 = 2;
  f.sigma1 = .3;
  f.sigma2 = .2;
  f.kappa = .4;
  f.steady = std::make_shared<Falling>();
  f.preload = .1;
  f.shape = shape;
  return f;
}

template <class E>
struct Rubbing {
  using Element = E;
  static constexpr bool ideal = false, balanced = true;
  static E make(Bench& bench) {
    E e;
    attach(bench, e);
    if constexpr (requires { e.radius; }) e.radius = .7;
    if constexpr (requires { e.omega; }) e.omega = make_constant_drive(1.3);
    if constexpr (requires { e.force; }) e.force = make_constant_drive(4.0);
    e.friction = friction(std::is_same_v<E, InLineFriction> ? Friction::Shape::simple
                                                            : Friction::Shape::plane_hinge);
    return e;
  }
};

/// Dry friction that slides: the contacts of the bench move.
template <class E>
struct Sliding : Rubbing<E> {
  static E make(Bench& bench) {
    E e = Rubbing<E>::make(bench);
    e.friction.law = Friction::Law::discrete_coulomb;
    return e;
  }
};

/// Dry friction that sticks under a preload beyond all loads.
template <class E>
struct Sticking : Sliding<E> {
  static E make(Bench& bench) {
    E e = Sliding<E>::make(bench);
    e.friction.preload = 1e18;
    return e;
  }
};

template <template <class> class Base>
struct OnThread : Base<ScrewFriction> {
  static constexpr bool balanced = false;  // as the screw without friction
  static ScrewFriction make(Bench& bench) {
    ScrewFriction e = Base<ScrewFriction>::make(bench);
    e.lead = .15;
    e.friction.shape = Friction::Shape::thread;
    e.friction.thread_gain = 1.2;
    e.friction.thread_slope = .3;
    return e;
  }
};

struct ScrewCase {
  using Element = Screw;
  static constexpr bool ideal = true, balanced = false;  // a thread that mixes frames, as MBDyn's
  static Screw make(Bench& bench) {
    Screw e;
    attach(bench, e);
    e.lead = .15;
    return e;
  }
};

struct TotalEquationCase {
  using Element = TotalEquation;
  static constexpr bool ideal = false,
                        balanced = false;  // loads act through a total internal reaction
  static TotalEquation make(Bench& bench) {
    using Kind = TotalConstraint::Kind;
    const Vec3 point = bench.vec();
    TotalEquation e;
    TotalJoint& t = e.equation;
    t.first = bench.first;
    t.second = bench.second;
    t.f1 = bench.offset(t.first, point);
    t.f2 = bench.offset(t.second, point);
    t.R1h = bench.rotation();
    t.R1r = bench.rotation();
    t.R2r = bench.rotation();
    t.constraint.translation[0] = t.constraint.rotation[2] = Kind::position;
    t.constraint.translation[2] = t.constraint.rotation[0] = Kind::velocity;
    t.constraint.displacement = t.constraint.angle = make_constant_vec3_drive(Vec3(.1, -.2, .3));
    return e;
  }
};

using Hinge = HingeFriction<RevoluteHinge>;
using Frictional =
    testing::Types<Rubbing<InLineFriction>, Rubbing<Hinge>, Rubbing<HingeFriction<AxialRotation>>,
                   Rubbing<Brake>, OnThread<Rubbing>, Sliding<InLineFriction>, Sliding<Hinge>,
                   Sliding<Brake>, OnThread<Sliding>, Sticking<InLineFriction>, Sticking<Hinge>,
                   ScrewCase, TotalEquationCase>;
MBCOSIM_CONFORMANCE(Frictional, Frictional);

}  // namespace
}  // namespace mbcosim::conformance::friction_conformance_test
