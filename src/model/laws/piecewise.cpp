// Laws made of pieces: double linear, contact, turbulent.
#include <cmath>

#include "model/laws/component.h"

namespace mbcosim {

namespace {

/// k₁ e + c ė inside [low, up]; slope k₂ and damping c₂ outside, without a jump in the elastic
/// part. In 3D the third component alone is double linear; the others use k₁ and c everywhere.
template <int N>
struct DoubleLinear {
  double k1, up, low, k2, c = 0, c2 = 0;

  template <class T>
  T operator()(int i, const T& e, const T& rate) const {
    const bool always_inside = N == 3 && i < 2;
    if (always_inside || (e >= low && e <= up)) return e * k1 + rate * c;
    const double bound = e > up ? up : low;
    return (e - bound) * k2 + k1 * bound + rate * c2;
  }
};

template <int N>
DoubleLinear<N> read_double_linear(Card& card) {
  DoubleLinear<N> d;
  d.k1 = card.real("first stiffness");
  d.up = card.real("upper strain");
  d.low = card.real("lower strain");
  if (d.up <= d.low)
    card.fail(
        "double linear: the upper strain " + std::to_string(d.up) +
            " must exceed the lower strain " + std::to_string(d.low),
        "the order of the arguments is stiffness, upper strain, lower strain, second stiffness");
  d.k2 = card.real("second stiffness");
  return d;
}

template <int N>
LawPtr<N> read_double_linear_elastic(Card& card) {
  const DoubleLinear<N> d = read_double_linear<N>(card);
  return make_component_law<N>(LawType::elastic, d, read_prestress<N>(card));
}

template <int N>
LawPtr<N> read_double_linear_viscoelastic(Card& card) {
  DoubleLinear<N> d = read_double_linear<N>(card);
  d.c = d.c2 = card.real("damping");
  if (card.keyword("second damping")) d.c2 = card.real("second damping");
  return make_component_law<N>(LawType::viscoelastic, d, read_prestress<N>(card));
}

/// kc (1 − (1 + e)^−γ) in compression, nothing in tension; in 3D on the third component.
template <int N>
struct Contact {
  double k, gamma;

  template <class T>
  T operator()(int i, const T& e, const T&) const {
    using std::pow;
    if ((N == 3 && i < 2) || e >= T(0.0)) return T(0.0);
    if (!(e > T(-1.0)))
      throw EvaluationError(
          "contact elastic: the strain reached -1, full compression; use a shorter step or a "
          "stiffer contact");
    return (T(1.0) - pow(e + 1.0, -gamma)) * k;
  }
};

template <int N>
LawPtr<N> read_contact(Card& card) {
  Contact<N> c;
  c.k = card.real("contact stiffness");
  if (c.k <= 0) card.warn("contact elastic: null or negative stiffness " + std::to_string(c.k));
  c.gamma = card.real("contact exponent");
  if (c.gamma < 1)
    card.fail("contact elastic: the exponent must be at least 1, got " + std::to_string(c.gamma));
  Prestress<N> pre = read_prestress<N>(card);
  if (N == 3 && !pre.is_null()) {  // as MBDyn
    card.warn("contact elastic: prestress and prestrain of the 3D law are ignored");
    pre = {};
  }
  return make_component_law<N>(LawType::elastic, c, std::move(pre));
}

/// k e + fd: fd = c |ė| ė from the threshold on, c_lin ė below.
struct Turbulent {
  double k, c, threshold = 0, linear = 0;

  template <class T>
  T operator()(int, const T& e, const T& rate) const {
    using std::abs;
    const T size = abs(rate);
    return e * k + (value_of(size) >= threshold ? T(size * c) : T(linear)) * rate;
  }
};

/// Is the next argument the optional number and not what follows the law?
bool at_number(Card& card) {
  if (!card.more()) return false;
  const std::string word = card.peek_word();
  return word != "prestress" && word != "prestrain" && word != "output";
}

LawPtr<1> read_turbulent(Card& card) {
  Turbulent t;
  t.k = card.real("stiffness");
  t.c = card.real("parabolic damping");
  if (at_number(card)) {
    t.threshold = card.real("threshold");
    if (t.threshold < 0)
      card.fail("turbulent viscoelastic: the threshold must not be negative, got " +
                std::to_string(t.threshold));
    t.linear = t.threshold * t.c;
    if (at_number(card)) t.linear = card.real("linear damping");
  }
  return make_component_law<1>(LawType::viscoelastic, t, read_prestress<1>(card));
}

template <int N>
void register_piecewise(Registry& r) {
  add_law<N>(r, {"double linear elastic"}, read_double_linear_elastic<N>);
  add_law<N>(r, {"double linear viscoelastic"}, read_double_linear_viscoelastic<N>);
  add_law<N>(r, {"contact elastic"}, read_contact<N>);
}

}  // namespace

void register_piecewise_laws(Registry& r) {
  register_piecewise<1>(r);
  register_piecewise<3>(r);
  r.law1({"turbulent viscoelastic"}, read_turbulent);
}

}  // namespace mbcosim
