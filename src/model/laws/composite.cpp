// Laws made of laws: array, drive caller wrapper, axial wrapper, invariant angular.
#include <algorithm>
#include <vector>

#include "math/rotation.h"
#include "model/laws/law_parts.h"

namespace mbcosim {

namespace {

/// Sum of laws.
template <int N>
class LawArray : public Law<N> {
 public:
  using V = VecN<N>;

  explicit LawArray(std::vector<LawPtr<N>> laws) : laws_(std::move(laws)) {}
  LawType type() const override {
    LawType t = laws_[0]->type();
    for (const auto& law : laws_) t = t | law->type();
    return t;
  }
  void respond(const EvalContext& context, const V& strain, const V& rate, bool tangent,
               typename Law<N>::Response& r) const override {
    laws_[0]->respond(context, strain, rate, tangent, r);
    typename Law<N>::Response part;
    for (std::size_t i = 1; i < laws_.size(); ++i) {
      laws_[i]->respond(context, strain, rate, tangent, part);
      r.f += part.f;
      if (!tangent) continue;
      r.de += part.de;
      r.dep += part.dep;
    }
  }
  void after_predict(const EvalContext& context, State& state, const V& strain,
                     const V& rate) const override {
    for (const auto& law : laws_) law->after_predict(context, state, strain, rate);
  }
  void after_convergence(const EvalContext& context, State& state, const V& strain,
                         const V& rate) const override {
    for (const auto& law : laws_) law->after_convergence(context, state, strain, rate);
  }
  bool has_memory() const override {
    return std::any_of(laws_.begin(), laws_.end(),
                       [](const auto& law) { return law->has_memory(); });
  }
  /// What the laws write, one after another; private data it has none, as in MBDyn.
  int output_size() const override {
    int size = 0;
    for (const auto& law : laws_) size += law->output_size();
    return size;
  }
  void output(const EvalContext& context, const V& strain, const V& rate,
              double* values) const override {
    for (const auto& law : laws_) {
      law->output(context, strain, rate, values);
      values += law->output_size();
    }
  }
  LawPtr<N> copy(ModelBuilder& builder) const override {
    std::vector<LawPtr<N>> laws;
    for (const auto& law : laws_) laws.push_back(copy_of(law, builder));
    return std::make_shared<LawArray>(std::move(laws));
  }

 private:
  std::vector<LawPtr<N>> laws_;
};

template <int N>
LawPtr<N> read_law_array(Card& card) {
  const int n = card.integer("number of laws");
  if (n < 1) card.fail("array: the number of laws must be at least 1, got " + std::to_string(n));
  std::vector<LawPtr<N>> laws;
  for (int i = 0; i < n; ++i) laws.push_back(card.template law<N>());
  if (n == 1) return laws[0];
  return std::make_shared<LawArray<N>>(std::move(laws));
}

/// factor(t) · law(ε, ε̇).
template <int N>
class DrivenLaw : public Law<N> {
 public:
  using V = VecN<N>;

  DrivenLaw(DrivePtr factor, LawPtr<N> law) : factor_(std::move(factor)), law_(std::move(law)) {}
  LawType type() const override { return law_->type(); }
  void respond(const EvalContext& context, const V& strain, const V& rate, bool tangent,
               typename Law<N>::Response& r) const override {
    law_->respond(context, strain, rate, tangent, r);
    const double factor = factor_->value(context);
    r.f *= factor;
    if (!tangent) return;
    r.de *= factor;
    r.dep *= factor;
  }
  void after_predict(const EvalContext& context, State& state, const V& strain,
                     const V& rate) const override {
    law_->after_predict(context, state, strain, rate);
  }
  void after_convergence(const EvalContext& context, State& state, const V& strain,
                         const V& rate) const override {
    law_->after_convergence(context, state, strain, rate);
  }
  bool has_memory() const override { return law_->has_memory(); }
  LawPtr<N> copy(ModelBuilder& builder) const override {
    return std::make_shared<DrivenLaw>(factor_, copy_of(law_, builder));
  }

 private:
  DrivePtr factor_;
  LawPtr<N> law_;
};

template <int N>
LawPtr<N> read_driven_law(Card& card) {
  DrivePtr factor = card.drive("factor of the law");
  LawPtr<N> law = card.template law<N>();
  return std::make_shared<DrivenLaw<N>>(std::move(factor), std::move(law));
}

/// n · law(n·ε, n·ε̇) along the unit vector n.
class AxialLaw : public Law<3> {
 public:
  AxialLaw(const Vec3& direction, LawPtr<1> law)
      : n_(direction.normalized()), law_(std::move(law)) {}
  LawType type() const override { return law_->type(); }
  void respond(const EvalContext& context, const Vec3& strain, const Vec3& rate, bool tangent,
               Response& r) const override {
    Law<1>::Response axial;
    law_->respond(context, along(strain), along(rate), tangent, axial);
    r.f = axial.f(0) * n_;
    if (!tangent) return;
    const Mat3 nn = n_ * n_.transpose();
    r.de = axial.de(0) * nn;
    r.dep = axial.dep(0) * nn;
  }
  void after_predict(const EvalContext& context, State& state, const Vec3& strain,
                     const Vec3& rate) const override {
    law_->after_predict(context, state, along(strain), along(rate));
  }
  void after_convergence(const EvalContext& context, State& state, const Vec3& strain,
                         const Vec3& rate) const override {
    law_->after_convergence(context, state, along(strain), along(rate));
  }
  bool has_memory() const override { return law_->has_memory(); }
  LawPtr<3> copy(ModelBuilder& builder) const override {
    return std::make_shared<AxialLaw>(n_, copy_of(law_, builder));
  }

 private:
  VecN<1> along(const Vec3& v) const { return VecN<1>(n_.dot(v)); }
  Vec3 n_;
  LawPtr<1> law_;
};

LawPtr<3> read_axial_law(Card& card) {
  const Vec3 direction = card.vec3("direction");
  if (direction.isZero(0)) card.fail("axial wrapper: the direction must not be null");
  return std::make_shared<AxialLaw>(direction, card.law1());
}

/// Γ(φ): ω = Γ(φ) φ̇ for R = exp(φ×).
Mat3 rotation_rate_matrix(const Vec3& phi) {
  const double q = phi.squaredNorm();
  double a, b;  // (1 − cos φ)/φ², (φ − sin φ)/φ³
  if (q < 1e-6) {
    a = 0.5 - q / 24 * (1 - q / 30);
    b = 1. / 6 - q / 120 * (1 - q / 42);
  } else {
    const double p = std::sqrt(q);
    a = (1 - std::cos(p)) / q;
    b = (p - std::sin(p)) / (q * p);
  }
  const Mat3 x = cross<double>(phi);
  return Mat3::Identity() + a * x + b * x * x;
}

/// f = R law(θ, Rᵀ ε̇) with R = exp(ξ θ×): an angular law between the frames of the two nodes (ξ =
/// 0, 1), or halfway.
class InvariantAngularLaw : public Law<3> {
 public:
  InvariantAngularLaw(double xi, LawPtr<3> law) : xi_(xi), law_(std::move(law)) {}
  LawType type() const override { return law_->type(); }
  void respond(const EvalContext& context, const Vec3& strain, const Vec3& rate, bool tangent,
               Response& r) const override {
    const Mat3 R = rotation(strain);
    const Vec3 local_rate = R.transpose() * rate;
    Response inner;
    law_->respond(context, strain, local_rate, tangent, inner);
    r.f = R * inner.f;
    if (!tangent) return;
    const Mat3 spin = xi_ * rotation_rate_matrix(xi_ * strain);  // δω = spin δθ, δR = δω× R
    r.de = R * inner.de +
           (R * inner.dep * R.transpose() * cross<double>(rate) - cross<double>(r.f)) * spin;
    r.dep = R * inner.dep * R.transpose();
  }
  void after_predict(const EvalContext& context, State& state, const Vec3& strain,
                     const Vec3& rate) const override {
    law_->after_predict(context, state, strain, rotation(strain).transpose() * rate);
  }
  void after_convergence(const EvalContext& context, State& state, const Vec3& strain,
                         const Vec3& rate) const override {
    law_->after_convergence(context, state, strain, rotation(strain).transpose() * rate);
  }
  bool has_memory() const override { return law_->has_memory(); }
  LawPtr<3> copy(ModelBuilder& builder) const override {
    return std::make_shared<InvariantAngularLaw>(xi_, copy_of(law_, builder));
  }

 private:
  Mat3 rotation(const Vec3& theta) const { return rotation_of_vector<double>(xi_ * theta); }
  double xi_;  ///< ξ
  LawPtr<3> law_;
};

LawPtr<3> read_invariant_angular(Card& card) {
  const double xi = card.real("position between the nodes");
  return std::make_shared<InvariantAngularLaw>(xi, card.law3());
}

template <int N>
void register_composite(Registry& r) {
  add_law<N>(r, {"array"}, read_law_array<N>);
  add_law<N>(r, {"drive caller wrapper"}, read_driven_law<N>);
}

}  // namespace

void register_composite_laws(Registry& r) {
  register_composite<1>(r);
  register_composite<3>(r);
  register_composite<6>(r);
  r.law3({"axial wrapper"}, read_axial_law);
  r.law3({"invariant angular"}, read_invariant_angular);
}

}  // namespace mbcosim
