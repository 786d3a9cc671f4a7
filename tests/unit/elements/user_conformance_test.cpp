/// Elements of MBDyn's modules, thermal and bulk elements and the helicoidal beam in the
/// conformance suite.
#include "elements/beams/helicoidal_beam.h"
#include "elements/conformance.h"
#include "elements/joints/point_contact.h"
#include "elements/joints/rod_bezier.h"
#include "elements/thermal/thermal.h"
#include "elements/user/asynchronous_machine.h"
#include "elements/user/bulk.h"
#include "elements/user/inline_friction.h"
#include "elements/user/wheel.h"
#include "model/drive.h"

namespace mbcosim::conformance::user_conformance_test {
namespace {

/// 0.7 + 0.3 x + 0.2 x².
class Curve final : public Drive {
 public:
  double value(const EvalContext&, double x) const override { return 0.7 + 0.3 * x + 0.2 * x * x; }
  bool has_derivative() const override { return true; }
  double derivative(const EvalContext&, double x) const override { return 0.3 + 0.4 * x; }
};

struct WheelCase {
  using Element = Wheel;
  static constexpr bool ideal = false, balanced = true;
  /// The ground's plane lies so that the tyre is in contact in all generic states.
  static Wheel make(Bench& bench) {
    Wheel e;
    e.wheel = bench.first;
    e.ground = bench.second;
    e.axle = bench.vec();
    e.N = bench.vec().normalized();
    e.R0 = 5;
    e.r0 = 2;
    e.Vc = 1.3;
    e.p0 = 0.4;
    e.gamma = 1.25;
    e.v_h = 7;
    const Vec3 between = bench.node(bench.second).R.transpose() *
                         (bench.node(bench.first).x - bench.node(bench.second).x);
    e.P = e.N * (between.dot(e.N) - e.R0 + 1.5) + 0.3 * bench.vec();
    return e;
  }
};

struct SlippingWheelCase : WheelCase {
  static Wheel make(Bench& bench) {
    Wheel e = WheelCase::make(bench);
    e.mu_x0 = e.mu_y0 = std::make_shared<Curve>();
    e.mu_y1 = make_constant_drive(0.4);
    e.v_t = 0.3;
    e.alpha_t = 0.8;
    return e;
  }
};

template <bool is_dry>
struct InlineFrictionCase {
  using Element = InlineFriction;
  static constexpr bool ideal = false,
                        balanced = false;  // the arms meet where the point is on the line
  static InlineFriction make(Bench& bench) {
    InlineFriction e;
    attach(bench, e);
    e.viscous = 0.6;
    if (!is_dry) return e;
    e.coulomb = 0.3;
    e.stiction = 0.5;
    e.v_s = 0.7;
    e.exponent = 1.5;
    e.slip = 0.4;
    e.scale = 1.7;
    return e;
  }
};

struct MachineCase {
  using Element = AsynchronousMachine;
  static constexpr bool ideal = false, balanced = true;
  static AsynchronousMachine make(Bench& bench) {
    AsynchronousMachine e;
    e.rotor = bench.first;
    e.stator = bench.second;
    e.M_K = 2.3;
    e.s_K = 0.4;
    e.synchronous = make_constant_drive(-3.1);
    return e;
  }
};

struct HelicoidalBeamCase {
  using Element = HelicoidalBeam;
  static constexpr bool ideal = false, balanced = true;
  /// Full stiffness, not symmetric.
  class GenericLaw : public Law<6> {
   public:
    explicit GenericLaw(Bench& bench) {
      for (int i = 0; i < 36; ++i) stiffness_(i) = bench.number();
    }
    LawType type() const override { return LawType::elastic; }
    void respond(const EvalContext&, const Vec6& strain, const Vec6&, bool,
                 Response& r) const override {
      r.f = stiffness_ * strain + Vec6::Ones();
      r.de = stiffness_;
      r.dep.setZero();
    }

   private:
    Mat6 stiffness_;
  };
  static HelicoidalBeam make(Bench& bench) {
    HelicoidalBeam e;
    e.node[0] = bench.first;
    e.node[1] = bench.second;
    for (int k = 0; k < 2; ++k) {
      e.offset[k] = bench.vec();
      e.relative[k] = bench.rotation();
    }
    e.law = std::make_shared<GenericLaw>(bench);
    e.set_geometry(bench.builder.model());
    return e;
  }
};

int add_thermal_node(Bench& bench) {
  ScalarNode node;
  node.kind = ScalarKind::thermal;
  node.label = static_cast<int>(bench.builder.model().scalars.size()) + 1;
  return bench.builder.add_scalar(node);
}

struct CapacitanceCase {
  using Element = ThermalCapacitance;
  static constexpr bool ideal = false, balanced = false;
  static ThermalCapacitance make(Bench& bench) { return {add_thermal_node(bench), 3.2}; }
};

struct ResistanceCase {
  using Element = ThermalResistance;
  static constexpr bool ideal = false, balanced = false;
  static ThermalResistance make(Bench& bench) {
    const int first = add_thermal_node(bench);
    return {first, add_thermal_node(bench), 0.7};
  }
};

struct BulkCase {
  using Element = BulkSpringSupport;
  static constexpr bool ideal = false, balanced = false;
  static BulkSpringSupport make(Bench& bench) {
    BulkSpringSupport e;
    e.dof.structural = true;
    e.dof.node = bench.second;
    e.dof.component = 1;
    e.stiffness = make_constant_drive(5.3);
    return e;
  }
};

struct RodBezierCase {
  using Element = RodBezier;
  static constexpr bool ideal = false, balanced = false;  // fixed directions
  class Law1 : public Law<1> {
   public:
    LawType type() const override { return LawType::viscoelastic; }
    void respond(const EvalContext&, const V& strain, const V& rate, bool,
                 Response& r) const override {
      r.f = 3 * strain + 0.7 * rate;
      r.de(0) = 3;
      r.dep(0) = 0.7;
    }
  };
  static RodBezier make(Bench& bench) {
    RodBezier e;
    e.first = bench.first;
    e.second = bench.second;
    e.O = bench.vec();
    e.A = bench.vec();
    e.B = bench.vec();
    e.I = bench.vec();
    e.set_quadrature(3, 2);
    e.L0 = 0.8 * e.set_geometry(bench.builder.model());
    e.law = std::make_shared<Law1>();
    return e;
  }
};

struct PointContactCase {
  using Element = PointContact;
  static constexpr bool ideal = false, balanced = true;
  static PointContact make(Bench& bench) {
    PointContact e;
    e.node = bench.first;
    e.surface = bench.second;
    e.normal = bench.node(bench.second).R.transpose() *
               (bench.node(bench.second).x - bench.node(bench.first).x).normalized();
    e.stiffness = 4.2;
    return e;
  }
};

using UserElements =
    testing::Types<RodBezierCase, PointContactCase, WheelCase, SlippingWheelCase,
                   InlineFrictionCase<true>, InlineFrictionCase<false>, MachineCase,
                   HelicoidalBeamCase, CapacitanceCase, ResistanceCase, BulkCase>;
MBCOSIM_CONFORMANCE(UserElements, UserElements);

}  // namespace
}  // namespace mbcosim::conformance::user_conformance_test
