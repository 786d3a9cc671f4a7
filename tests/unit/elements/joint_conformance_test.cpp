/// Joint types in the conformance suite.
#include "elements/conformance.h"
#include "elements/joints/clamp.h"
#include "elements/joints/deformable.h"
#include "elements/joints/distance.h"
#include "elements/joints/guide.h"
#include "elements/joints/invariant.h"
#include "elements/joints/revolute.h"
#include "elements/joints/rod.h"
#include "elements/joints/spherical.h"
#include "elements/joints/total.h"
#include "elements/joints/universal.h"
#include "elements/joints/velocity.h"
#include "model/drive.h"

namespace mbcosim::conformance::joint_conformance_test {
namespace {

/// A joint between two nodes that only needs its attachments.
template <class E, bool is_ideal = true>
struct Between {
  using Element = E;
  static constexpr bool ideal = is_ideal, balanced = true;
  static E make(Bench& bench) {
    E e;
    attach(bench, e);
    return e;
  }
};

struct ClampCase {
  using Element = Clamp;
  static constexpr bool ideal = true, balanced = false;
  static Clamp make(Bench& bench) {
    Clamp e;
    e.node = bench.first;
    e.X0 = bench.node(bench.first).x;
    e.R0 = bench.node(bench.first).R;
    return e;
  }
};

struct RevolutePinCase {
  using Element = RevolutePin;
  static constexpr bool ideal = true, balanced = false;
  static RevolutePin make(Bench& bench) {
    RevolutePin e;
    e.X0 = bench.vec();
    e.R0 = bench.rotation();
    e.a = {bench.first, bench.offset(bench.first, e.X0),
           bench.relative(bench.first, e.R0 * rotation_z(0.4))};
    return e;
  }
};

struct SphericalPinCase {
  using Element = SphericalPin;
  static constexpr bool ideal = true, balanced = false;
  static SphericalPin make(Bench& bench) {
    SphericalPin e;
    e.X0 = bench.vec();
    e.a = {bench.first, bench.offset(bench.first, e.X0), Mat3::Identity()};
    return e;
  }
};

struct AxialRotationCase : Between<AxialRotation> {
  static AxialRotation make(Bench& bench) {
    AxialRotation e = Between<AxialRotation>::make(bench);
    e.omega = make_constant_drive(1.3);
    return e;
  }
};

struct DistanceCase : Between<Distance, false> {
  static constexpr bool balanced = false;  // the force acts along an unknown direction
  static Distance make(Bench& bench) {
    Distance e = Between<Distance, false>::make(bench);
    e.b.f += Vec3(0.5, 0.3, -0.6);
    e.offsets = true;
    e.length = make_constant_drive(e.b.f.norm());
    return e;
  }
};

/// A law with full, unsymmetric stiffness and damping and a cubic part.
template <int N>
class GenericLaw : public Law<N> {
 public:
  using typename Law<N>::V;
  using typename Law<N>::M;
  using typename Law<N>::Response;
  explicit GenericLaw(Bench& bench) {
    for (int i = 0; i < N * N; ++i) {
      stiffness_(i) = bench.number();
      damping_(i) = bench.number();
    }
  }
  LawType type() const override { return LawType::viscoelastic; }
  void respond(const EvalContext&, const V& strain, const V& rate, bool tangent,
               Response& r) const override {
    r.f = stiffness_ * strain + damping_ * rate + V(strain.array().cube());
    if (!tangent) return;
    r.de = stiffness_ + M((3 * strain.array().square()).matrix().asDiagonal());
    r.dep = damping_;
  }

 private:
  M stiffness_, damping_;
};

template <class E, int N>
struct Deformable : Between<E, false> {
  static E make(Bench& bench) {
    E e = Between<E, false>::make(bench);
    e.b.f += 0.2 * bench.vec();
    e.b.Rh = e.b.Rh * rotation_of_vector<double>(0.4 * bench.vec());
    e.law = std::make_shared<GenericLaw<N>>(bench);
    return e;
  }
};

struct RodCase : Deformable<Rod, 1> {
  static Rod make(Bench& bench) {
    Rod e = Deformable<Rod, 1>::make(bench);
    e.b.f += Vec3(1, 2, 3);
    e.L0 = 3.2;
    return e;
  }
};

struct ViscousBodyCase {
  using Element = ViscousBody;
  static constexpr bool ideal = false, balanced = false;
  static ViscousBody make(Bench& bench) {
    ViscousBody e;
    e.a = {bench.first, bench.vec(), bench.rotation()};
    e.law = std::make_shared<GenericLaw<6>>(bench);
    return e;
  }
};

struct InLineCase : Between<InLine> {
  static InLine make(Bench& bench) {
    InLine e = Between<InLine>::make(bench);
    e.a.f += 0.7 * e.a.Rh.col(2);  // another point of the same line
    return e;
  }
};

struct InPlaneCase : Between<InPlane> {
  static InPlane make(Bench& bench) {
    InPlane e = Between<InPlane>::make(bench);
    e.normal = e.a.Rh.col(2);
    e.a.f += 0.7 * e.a.Rh.col(0) - 0.2 * e.a.Rh.col(1);
    return e;
  }
};

/// Hinge frames that are not parallel, with the axes of the joint at a right angle.
template <class E>
struct Cardano : Between<E> {
  static E make(Bench& bench) {
    E e = Between<E>::make(bench);
    e.b.Rh = e.b.Rh * rotation_y(0.6);
    return e;
  }
};

struct CardanoPinCase {
  using Element = CardanoPin;
  static constexpr bool ideal = true, balanced = false;
  static CardanoPin make(Bench& bench) {
    CardanoPin e;
    e.X0 = bench.vec();
    e.R0 = bench.rotation();
    e.a = {bench.first, bench.offset(bench.first, e.X0),
           bench.relative(bench.first, e.R0 * rotation_y(0.4))};
    return e;
  }
};

struct DriveHingeCase : Between<DriveHinge, false> {  // ideal for a null rotation only
  static DriveHinge make(Bench& bench) {
    DriveHinge e = Between<DriveHinge, false>::make(bench);
    e.theta = make_constant_vec3_drive(Vec3(0.3, -0.2, 0.5));
    return e;
  }
};

struct DriveDisplacementCase : Between<DriveDisplacement> {
  static DriveDisplacement make(Bench& bench) {
    DriveDisplacement e = Between<DriveDisplacement>::make(bench);
    const Vec3 delta(0.3, -0.2, 0.5);
    e.a.f -= delta;
    e.delta = make_constant_vec3_drive(delta);
    return e;
  }
};

struct DriveDisplacementPinCase {
  using Element = DriveDisplacementPin;
  static constexpr bool ideal = true, balanced = false;
  static DriveDisplacementPin make(Bench& bench) {
    DriveDisplacementPin e;
    e.a = {bench.first, bench.vec(), Mat3::Identity()};
    e.delta = make_constant_vec3_drive(Vec3(0.3, -0.2, 0.5));
    return e;
  }
};

template <class E>
struct ImposedVelocity {
  using Element = E;
  static constexpr bool ideal = true, balanced = false;
  static E make(Bench& bench) {
    E e;
    e.node = bench.first;
    e.direction = bench.vec().normalized();
    e.velocity = make_constant_drive(0.8);
    return e;
  }
};

template <class E>
struct ImposedAcceleration {
  using Element = E;
  static constexpr bool ideal = false, balanced = false;
  static E make(Bench& bench) {
    E e;
    e.node = bench.first;
    e.direction = bench.vec().normalized();
    e.acceleration = make_constant_drive(0.8);
    return e;
  }
};

using Kind = TotalConstraint::Kind;

TotalConstraint constraint(Kind t1, Kind t2, Kind t3, Kind r1, Kind r2, Kind r3) {
  TotalConstraint c;
  const Kind t[3] = {t1, t2, t3}, r[3] = {r1, r2, r3};
  std::copy(t, t + 3, c.translation);
  std::copy(r, r + 3, c.rotation);
  c.displacement = make_constant_vec3_drive(Vec3::Zero());
  c.angle = make_constant_vec3_drive(Vec3::Zero());
  return c;
}
TotalConstraint full() {
  return constraint(Kind::position, Kind::position, Kind::position, Kind::position, Kind::position,
                    Kind::position);
}
TotalConstraint partial() {
  return constraint(Kind::position, Kind::free, Kind::velocity, Kind::free, Kind::position,
                    Kind::velocity);
}

template <TotalConstraint (*constraints)()>
struct Total {
  using Element = TotalJoint;
  static constexpr bool ideal = true, balanced = true;
  static TotalJoint make(Bench& bench) {
    TotalJoint e;
    const Vec3 point = bench.vec();
    const Mat3 frame = bench.rotation();
    e.first = bench.first;
    e.second = bench.second;
    e.f1 = bench.offset(e.first, point);
    e.f2 = bench.offset(e.second, point);
    e.R1h = bench.rotation();
    e.R1r = bench.relative(e.first, frame);
    e.R2r = bench.relative(e.second, frame);
    e.constraint = constraints();
    return e;
  }
};

template <TotalConstraint (*constraints)()>
struct TotalPin {
  using Element = TotalPinJoint;
  static constexpr bool ideal = true, balanced = false;
  static TotalPinJoint make(Bench& bench) {
    TotalPinJoint e;
    e.node = bench.first;
    e.Xc = bench.vec();
    e.Rc = bench.rotation();
    e.Rcr = e.Rc;  // the angular velocity row uses Rc, the moment Rcr
    e.f = bench.offset(e.node, e.Xc);
    e.Rr = bench.relative(e.node, e.Rcr);
    e.constraint = constraints();
    return e;
  }
};

using Constraints =
    testing::Types<ClampCase, RevolutePinCase, Between<RevoluteHinge>, Between<RevoluteRotation>,
                   AxialRotationCase, Between<SphericalHinge>, SphericalPinCase, DistanceCase,
                   InLineCase, InPlaneCase, Between<Prismatic>, DriveHingeCase,
                   DriveDisplacementCase, DriveDisplacementPinCase, Cardano<CardanoHinge>,
                   Cardano<CardanoRotation>, CardanoPinCase, Between<GimbalRotation, false>,
                   ImposedVelocity<LinearVelocity>, ImposedVelocity<AngularVelocity>,
                   ImposedAcceleration<LinearAcceleration>,
                   ImposedAcceleration<AngularAcceleration>, Total<full>, Total<partial>,
                   TotalPin<full>, TotalPin<partial>>;
MBCOSIM_CONFORMANCE(Constraints, Constraints);

using Deformables =
    testing::Types<RodCase, Deformable<DeformableHinge, 3>, Deformable<DeformableDisplacement, 3>,
                   Deformable<DeformableJoint, 6>, Deformable<DeformableAxialJoint, 1>,
                   Deformable<InvariantHinge, 3>, Deformable<InvariantDisplacement, 3>,
                   Deformable<InvariantJoint, 6>, ViscousBodyCase>;
MBCOSIM_CONFORMANCE(Deformables, Deformables);

}  // namespace
}  // namespace mbcosim::conformance::joint_conformance_test
