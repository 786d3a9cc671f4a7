/// Joint types in the conformance suite.
#include "elements/conformance.h"
#include "elements/joints/clamp.h"
#include "elements/joints/distance.h"
#include "elements/joints/revolute.h"
#include "elements/joints/spherical.h"
#include "model/drive.h"

namespace mbcosim::conformance {
namespace {

/// Attachments of both nodes to the same generic point and frame.
template <class E>
void attach(Bench& bench, E& e) {
  const Vec3 point = bench.vec();
  const Mat3 frame = bench.rotation();
  e.a = {bench.first, bench.offset(bench.first, point), bench.relative(bench.first, frame)};
  e.b = {bench.second, bench.offset(bench.second, point), bench.relative(bench.second, frame)};
}

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

using Joints =
    testing::Types<ClampCase, RevolutePinCase, Between<RevoluteHinge>, Between<RevoluteRotation>,
                   AxialRotationCase, Between<SphericalHinge>, SphericalPinCase, DistanceCase>;
INSTANTIATE_TYPED_TEST_SUITE_P(Joints, ElementConformance, Joints);

}  // namespace
}  // namespace mbcosim::conformance
