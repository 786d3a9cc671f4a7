// Laws given by scalar functions: scalar function, nlsf, nlp.
#include <array>

#include "model/laws/component.h"
#include "model/scalar_function.h"

namespace mbcosim {

namespace {

template <int N>
using Functions = std::array<ScalarFunctionPtr, N>;

template <int N>
Functions<N> read_functions(Card& card, const char* what) {
  Functions<N> f;
  for (auto& p : f)
    if (!card.keyword("null")) p = card.scalar_function(what);
  return f;
}

template <int N>
bool any(const Functions<N>& f) {
  for (const auto& p : f)
    if (p) return true;
  return false;
}

template <class T>
T apply(const ScalarFunctionPtr& f, const T& x) {
  return f ? (*f)(x) : T(0.0);
}

/// fᵢ(εᵢ), or with the rate's functions fᵢ(eᵢ) + gᵢ(ε̇ᵢ).
template <int N>
struct SumOfFunctions {
  Functions<N> f, g;
  template <class T>
  T operator()(int i, const T& e, const T& rate) const {
    return apply(f[i], e) + apply(g[i], rate);
  }
};

/// fᵢ(eᵢ) eᵢ + gᵢ(eᵢ) ε̇ᵢ: both functions take the strain.
template <int N>
struct ProductOfFunctions {
  Functions<N> f, g;
  template <class T>
  T operator()(int i, const T& e, const T& rate) const {
    return apply(f[i], e) * e + apply(g[i], e) * rate;
  }
};

template <int N>
LawPtr<N> read_isotropic_function(Card& card) {
  SumOfFunctions<N> s;
  s.f.fill(card.scalar_function());
  return make_component_law<N>(LawType::elastic, std::move(s), Prestress<N>());
}

template <int N>
LawPtr<N> read_orthotropic_function(Card& card) {
  SumOfFunctions<N> s;
  s.f = read_functions<N>(card, "scalar function");
  return make_component_law<N>(LawType::elastic, std::move(s), Prestress<N>());
}

/// What the keyword announces: parts to read.
struct Parts {
  bool elastic, viscous;
};

template <int N>
struct FunctionLawData {
  MatN<N> stiffness = MatN<N>::Zero(), damping = MatN<N>::Zero();
  Functions<N> f, g;
  Prestress<N> pre;

  bool has_elastic() const { return !stiffness.isZero(0) || any<N>(f); }
  bool has_viscous() const { return !damping.isZero(0) || any<N>(g); }
  /// The parts that are present decide, not the keyword.
  LawType type(Parts parts) const {
    if (has_elastic() && has_viscous()) return LawType::viscoelastic;
    if (has_viscous()) return LawType::viscous;
    return has_elastic() || parts.elastic ? LawType::elastic : LawType::viscous;
  }
};

template <int N>
FunctionLawData<N> read_function_law(Card& card, Parts parts) {
  FunctionLawData<N> d;
  if (parts.elastic) {
    d.stiffness = read_law_matrix<N>(card, "stiffness");
    d.f = read_functions<N>(card, "elastic scalar function");
  }
  if (parts.viscous) {
    d.damping =
        parts.elastic ? read_damping<N>(card, d.stiffness) : read_law_matrix<N>(card, "damping");
    d.g = read_functions<N>(card, "viscous scalar function");
  }
  d.pre = read_prestress<N>(card);
  return d;
}

/// f = σ₀ + K e + fᵢ(eᵢ) + C ε̇ + gᵢ(ε̇ᵢ). As in MBDyn, laws of more dimensions without an elastic
/// part leave the gᵢ out.
template <int N, Parts parts>
LawPtr<N> read_nlsf(Card& card) {
  FunctionLawData<N> d = read_function_law<N>(card, parts);
  const LawType type = d.type(parts);
  SumOfFunctions<N> s{std::move(d.f), std::move(d.g)};
  if (N > 1 && type == LawType::viscous && any<N>(s.g)) {
    card.warn(
        "nlsf: the viscous functions are ignored, because the law has no elastic part (as in "
        "MBDyn)");
    s.g = {};
  }
  return make_component_law<N>(type, std::move(s), std::move(d.pre), d.stiffness, d.damping);
}

/// f = σ₀ + (K + diag fᵢ(eᵢ)) e + (C + diag gᵢ(eᵢ)) ε̇.
template <int N, Parts parts>
LawPtr<N> read_nlp(Card& card) {
  FunctionLawData<N> d = read_function_law<N>(card, parts);
  const LawType type = d.type(parts);
  ProductOfFunctions<N> s{std::move(d.f), std::move(d.g)};
  return make_component_law<N>(type, std::move(s), std::move(d.pre), d.stiffness, d.damping);
}

template <int N>
void register_functions(Registry& r) {
  constexpr Parts elastic{true, false}, viscous{false, true}, both{true, true};
  add_law<N>(r, {"scalar function elastic isotropic"}, read_isotropic_function<N>);
  add_law<N>(r, {"scalar function elastic orthotropic"}, read_orthotropic_function<N>);
  add_law<N>(r, {"nlsf elastic"}, read_nlsf<N, elastic>);
  add_law<N>(r, {"nlsf viscous"}, read_nlsf<N, viscous>);
  add_law<N>(r, {"nlsf viscoelastic"}, read_nlsf<N, both>);
  add_law<N>(r, {"nlp elastic"}, read_nlp<N, elastic>);
  add_law<N>(r, {"nlp viscous"}, read_nlp<N, viscous>);
  add_law<N>(r, {"nlp viscoelastic"}, read_nlp<N, both>);
}

}  // namespace

void register_function_laws(Registry& r) {
  register_functions<1>(r);
  register_functions<3>(r);
  register_functions<6>(r);
  r.law1({"scalar function elastic"}, read_isotropic_function<1>);
}

}  // namespace mbcosim
