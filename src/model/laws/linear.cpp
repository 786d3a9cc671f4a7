#include "model/laws/linear.h"

namespace mbcosim {

template <int N>
void LinearLaw<N>::respond(const EvalContext& context, const V& strain, const V& rate, bool tangent,
                           Response& r) const {
  const double a = a_ ? a_->value(context) : 1;
  const double b = b_ ? b_->value(context) : 1;
  r.f = pre_.stress;
  if (type_ != LawType::viscous) r.f += a * (stiffness_ * pre_.reduced(context, strain));
  if (type_ != LawType::elastic) r.f += b * (damping_ * rate);
  if (!tangent) return;
  r.de = a * stiffness_;
  if (type_ == LawType::elastic)
    r.dep.setZero();
  else
    r.dep = b * damping_;
}

template class LinearLaw<1>;
template class LinearLaw<3>;
template class LinearLaw<6>;

void AxialTorsionLaw::respond(const EvalContext& context, const Vec6& strain, const Vec6& rate,
                              bool tangent, Response& r) const {
  const Vec6 e = pre_.reduced(context, strain);
  Mat6 k = stiffness_;
  k(3, 3) += coupling_ * strain(0);
  r.f = pre_.stress + k * e;
  if (type_ != LawType::elastic) r.f += damping_ * rate;
  if (!tangent) return;
  r.de = k;
  r.de(3, 0) += coupling_ * e(3);
  r.dep = damping_;
}

double read_scalar_damping(Card& card, double stiffness) {
  if (card.keyword("proportional")) return card.real("proportionality factor") * stiffness;
  return card.real("damping");
}

namespace {

template <int N>
LawPtr<N> make_linear(LawType type, const MatN<N>& k, const MatN<N>& c, Prestress<N> pre) {
  return std::make_shared<LinearLaw<N>>(type, k, c, std::move(pre));
}

template <int N>
LawPtr<N> read_linear_elastic(Card& card) {
  const double k = card.real("stiffness");
  if (k <= 0) card.warn("linear elastic: null or negative stiffness " + std::to_string(k));
  return make_linear<N>(LawType::elastic, k * MatN<N>::Identity(), MatN<N>::Zero(),
                        read_prestress<N>(card));
}

template <int N>
LawPtr<N> read_linear_elastic_generic(Card& card) {
  const MatN<N> k = read_law_matrix<N>(card, "stiffness");
  return make_linear<N>(LawType::elastic, k, MatN<N>::Zero(), read_prestress<N>(card));
}

/// MBDyn reads a prestress here and drops it.
template <int N>
void ignore_prestress(Card& card) {
  if (!card.keyword("prestress")) return;
  read_law_vector<N>(card, "prestress");
  card.warn("a viscous law has no prestress; it is ignored",
            "use `linear viscoelastic` with its stiffness");
}

template <int N>
LawPtr<N> read_linear_viscous(Card& card) {
  const double c = card.real("damping");
  if (c <= 0) card.warn("linear viscous: null or negative damping " + std::to_string(c));
  ignore_prestress<N>(card);
  return make_linear<N>(LawType::viscous, MatN<N>::Zero(), c * MatN<N>::Identity(), {});
}

template <int N>
LawPtr<N> read_linear_viscous_generic(Card& card) {
  const MatN<N> c = read_law_matrix<N>(card, "damping");
  ignore_prestress<N>(card);
  return make_linear<N>(LawType::viscous, MatN<N>::Zero(), c, {});
}

/// Without stiffness the law is viscous: prestress and prestrain are dropped, as in MBDyn.
template <int N>
LawPtr<N> finish_viscoelastic(Card& card, const MatN<N>& k, const MatN<N>& c) {
  Prestress<N> pre = read_prestress<N>(card);
  if (c.isZero(0)) card.warn("linear viscoelastic: the damping is null; the law is elastic");
  if (!k.isZero(0)) return make_linear<N>(LawType::viscoelastic, k, c, std::move(pre));
  card.warn(pre.is_null() ? "linear viscoelastic: the stiffness is null; the law is viscous"
                          : "linear viscoelastic: the stiffness is null; the law is viscous, "
                            "prestress and prestrain are ignored");
  return make_linear<N>(LawType::viscous, k, c, {});
}

template <int N>
LawPtr<N> read_linear_viscoelastic(Card& card) {
  const double k = card.real("stiffness");
  const double c = read_scalar_damping(card, k);
  return finish_viscoelastic<N>(card, k * MatN<N>::Identity(), c * MatN<N>::Identity());
}

template <int N>
LawPtr<N> read_linear_viscoelastic_generic(Card& card) {
  const MatN<N> k = read_law_matrix<N>(card, "stiffness");
  const MatN<N> c = read_damping<N>(card, k);
  return finish_viscoelastic<N>(card, k, c);
}

template <int N>
LawPtr<N> read_time_variant(Card& card) {
  const MatN<N> k = read_law_matrix<N>(card, "stiffness");
  DrivePtr a = card.drive("stiffness factor");
  const MatN<N> c = read_damping<N>(card, k);
  DrivePtr b = card.drive("damping factor");
  return std::make_shared<LinearLaw<N>>(LawType::viscoelastic, k, c, read_prestress<N>(card),
                                        std::move(a), std::move(b));
}

LawPtr<6> read_axial_torsion_elastic(Card& card) {
  const Mat6 k = card.mat6("stiffness");
  const double coupling = card.real("axial-torsion coupling");
  return std::make_shared<AxialTorsionLaw>(LawType::elastic, k, Mat6::Zero(), coupling,
                                           read_prestress<6>(card));
}

LawPtr<6> read_axial_torsion_viscoelastic(Card& card) {
  const Mat6 k = card.mat6("stiffness");
  const Mat6 c = read_damping<6>(card, k);
  const double coupling = card.real("axial-torsion coupling");
  return std::make_shared<AxialTorsionLaw>(LawType::viscoelastic, k, c, coupling,
                                           read_prestress<6>(card));
}

template <int N>
void register_linear(Registry& r) {
  add_law<N>(r, {"linear elastic", "linear elastic isotropic"}, read_linear_elastic<N>);
  add_law<N>(r, {"linear elastic generic"}, read_linear_elastic_generic<N>);
  add_law<N>(r, {"linear viscous", "linear viscous isotropic"}, read_linear_viscous<N>);
  add_law<N>(r, {"linear viscous generic"}, read_linear_viscous_generic<N>);
  add_law<N>(r, {"linear viscoelastic", "linear viscoelastic isotropic"},
             read_linear_viscoelastic<N>);
  add_law<N>(r, {"linear viscoelastic generic"}, read_linear_viscoelastic_generic<N>);
  add_law<N>(r, {"linear time variant viscoelastic generic"}, read_time_variant<N>);
}

}  // namespace

void register_linear_laws(Registry& r) {
  register_linear<1>(r);
  register_linear<3>(r);
  register_linear<6>(r);
  r.law6({"linear elastic generic axial torsion coupling"}, read_axial_torsion_elastic);
  r.law6({"linear viscoelastic generic axial torsion coupling"}, read_axial_torsion_viscoelastic);
}

}  // namespace mbcosim
