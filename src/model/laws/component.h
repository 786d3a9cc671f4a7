/// Laws that act on each strain component alone, beside linear terms.
#pragma once

#include "math/dual.h"
#include "model/laws/law_parts.h"

namespace mbcosim {

/// f = σ₀ + K e + C ε̇ + φᵢ(eᵢ, ε̇ᵢ) with e = ε − ε₀(t).
///
/// `Formula` has `template <class T> T operator()(int component, const T& e, const T& rate) const`;
/// derivatives come from dual numbers.
template <int N, class Formula>
class ComponentLaw : public Law<N> {
 public:
  using V = VecN<N>;
  using M = MatN<N>;

  ComponentLaw(LawType type, Formula formula, Prestress<N> pre, M stiffness = M::Zero(),
               M damping = M::Zero())
      : type_(type),
        formula_(std::move(formula)),
        pre_(std::move(pre)),
        stiffness_(stiffness),
        damping_(damping) {}
  LawType type() const override { return type_; }

  void respond(const EvalContext& context, const V& strain, const V& rate, bool tangent,
               typename Law<N>::Response& r) const override {
    const V e = pre_.reduced(context, strain);
    r.f = pre_.stress + stiffness_ * e + damping_ * rate;
    if (!tangent) {
      for (int i = 0; i < N; ++i) r.f(i) += formula_(i, e(i), rate(i));
      return;
    }
    r.de = stiffness_;
    r.dep = damping_;
    for (int i = 0; i < N; ++i) {
      using D = Dual<2>;
      const D f = formula_(i, D::variable(e(i), 0), D::variable(rate(i), 1));
      r.f(i) += f.v;
      r.de(i, i) += f.d[0];
      r.dep(i, i) += f.d[1];
    }
  }

 private:
  LawType type_;
  Formula formula_;
  Prestress<N> pre_;
  M stiffness_, damping_;  ///< K, C
};

template <int N, class Formula>
LawPtr<N> make_component_law(LawType type, Formula formula, Prestress<N> pre,
                             const MatN<N>& stiffness = MatN<N>::Zero(),
                             const MatN<N>& damping = MatN<N>::Zero()) {
  return std::make_shared<ComponentLaw<N, Formula>>(type, std::move(formula), std::move(pre),
                                                    stiffness, damping);
}

}  // namespace mbcosim
