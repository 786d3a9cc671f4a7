// Smooth nonlinear laws: cubic, inverse square, logarithmic, isotropic hardening.
#include <cmath>

#include "model/laws/component.h"

namespace mbcosim {

namespace {

/// s₁ e + s₂ |e| e + s₃ e³ by component.
template <int N>
struct Cubic {
  VecN<N> s1, s2, s3;

  template <class T>
  T operator()(int i, const T& e, const T&) const {
    using std::abs;
    return e * (s1(i) + (abs(e) * s2(i) + e * e * s3(i)));
  }
};

template <int N>
Cubic<N> read_cubic(Card& card) {
  Cubic<N> c;
  c.s1 = read_law_vector<N>(card, "linear stiffness");
  c.s2 = read_law_vector<N>(card, "quadratic stiffness");
  c.s3 = read_law_vector<N>(card, "cubic stiffness");
  return c;
}

template <int N>
LawPtr<N> read_cubic_elastic(Card& card) {
  const Cubic<N> c = read_cubic<N>(card);
  return make_component_law<N>(LawType::elastic, c, read_prestress<N>(card));
}

template <int N>
LawPtr<N> read_cubic_viscoelastic(Card& card) {
  const Cubic<N> c = read_cubic<N>(card);
  const MatN<N> damping = read_law_matrix<N>(card, "damping");
  return make_component_law<N>(LawType::viscoelastic, c, read_prestress<N>(card), MatN<N>::Zero(),
                               damping);
}

/// A / (L₀ (1 + e))².
struct InverseSquare {
  double a, length;

  template <class T>
  T operator()(int, const T& e, const T&) const {
    const T l = (e + 1.0) * length;
    if (value_of(l) == 0)
      throw EvaluationError("inverse square elastic: the strain reached -1, null length");
    return T(a) / (l * l);
  }
};

LawPtr<1> read_inverse_square(Card& card) {
  InverseSquare s;
  s.a = card.real("stiffness");
  s.length = card.real("reference length");
  if (!(s.length > 0))
    card.fail("inverse square elastic: the reference length must be positive, got " +
              std::to_string(s.length));
  return make_component_law<1>(LawType::elastic, s, read_prestress<1>(card));
}

/// k ln(1 + e).
struct Logarithmic {
  double k;

  template <class T>
  T operator()(int, const T& e, const T&) const {
    using std::log;
    if (!(value_of(e) > -1)) throw EvaluationError("log elastic: 1 + strain must be positive");
    return log(e + 1.0) * k;
  }
};

LawPtr<1> read_logarithmic(Card& card) {
  const Logarithmic l{card.real("stiffness")};
  if (l.k <= 0) card.warn("log elastic: null or negative stiffness " + std::to_string(l.k));
  return make_component_law<1>(LawType::elastic, l, read_prestress<1>(card));
}

/// f = σ₀ + k s(E) e, s = (β + αE)/(1 + αE), E = |e|²; α = 3/ε_ref², β = k₀/k. From slope k₀ at
/// rest to k far away.
template <int N>
class IsotropicHardening : public Law<N> {
 public:
  using V = VecN<N>;
  IsotropicHardening(double k, double alpha, double beta, Prestress<N> pre)
      : k_(k), alpha_(alpha), beta_(beta), pre_(std::move(pre)) {}
  LawType type() const override { return LawType::elastic; }
  void respond(const EvalContext& context, const V& strain, const V&, bool tangent,
               typename Law<N>::Response& r) const override {
    const V e = pre_.reduced(context, strain);
    const double q = alpha_ * e.squaredNorm();
    const double s = (beta_ + q) / (1 + q);
    r.f = pre_.stress + k_ * s * e;
    if (!tangent) return;
    const double ds = alpha_ * (1 - beta_) / ((1 + q) * (1 + q));  // ds/dE
    r.de = k_ * (s * MatN<N>::Identity() + 2 * ds * e * e.transpose());
    r.dep.setZero();
  }

 private:
  double k_, alpha_, beta_;
  Prestress<N> pre_;
};

template <int N>
LawPtr<N> read_hardening(Card& card) {
  const double k = card.real("stiffness");
  if (k == 0) card.fail("isotropic hardening elastic: the stiffness must not be null");
  const double reference = card.real("reference strain");
  if (!(reference > 0))
    card.fail("isotropic hardening elastic: the reference strain must be positive, got " +
              std::to_string(reference));
  const double k0 = card.keyword("linear stiffness") ? card.real("linear stiffness") : 0;
  return std::make_shared<IsotropicHardening<N>>(k, 3 / (reference * reference), k0 / k,
                                                 read_prestress<N>(card));
}

}  // namespace

void register_smooth_laws(Registry& r) {
  r.law1({"cubic elastic generic"}, read_cubic_elastic<1>);
  r.law3({"cubic elastic generic"}, read_cubic_elastic<3>);
  r.law1({"cubic viscoelastic generic"}, read_cubic_viscoelastic<1>);
  r.law3({"cubic viscoelastic generic"}, read_cubic_viscoelastic<3>);
  r.law1({"inverse square elastic"}, read_inverse_square);
  r.law1({"log elastic"}, read_logarithmic);
  r.law1({"isotropic hardening elastic"}, read_hardening<1>);
  r.law3({"isotropic hardening elastic"}, read_hardening<3>);
  r.law6({"isotropic hardening elastic"}, read_hardening<6>);
}

}  // namespace mbcosim
