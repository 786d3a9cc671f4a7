// Laws written as expressions of the strain and its rate.
#include <string>
#include <vector>

#include "model/expression.h"
#include "model/laws/law_parts.h"

namespace mbcosim {

namespace {

/// f = σ₀ + expression(e, ε̇), one expression a component, with exact derivatives.
template <int N>
class SymbolicLaw : public Law<N> {
 public:
  using V = VecN<N>;

  SymbolicLaw(LawType type, std::vector<ExpressionPtr> expressions, Prestress<N> pre)
      : type_(type), expressions_(std::move(expressions)), pre_(std::move(pre)) {}
  LawType type() const override { return type_; }
  void respond(const EvalContext& context, const V& strain, const V& rate, bool tangent,
               typename Law<N>::Response& r) const override {
    double arguments[2 * N], gradient[2 * N];
    const V e = pre_.reduced(context, strain);
    const bool elastic = type_ != LawType::viscous, viscous = type_ != LawType::elastic;
    double* next = arguments;
    if (elastic) next = std::copy(e.data(), e.data() + N, next);
    if (viscous) std::copy(rate.data(), rate.data() + N, next);
    r.f = pre_.stress;
    if (tangent) {
      r.de.setZero();
      r.dep.setZero();
    }
    for (int i = 0; i < N; ++i) {
      if (!tangent) {
        r.f(i) += expressions_[i]->value(context, arguments);
        continue;
      }
      r.f(i) += expressions_[i]->value_and_gradient(context, arguments, gradient);
      for (int j = 0; j < N; ++j) {
        if (elastic) r.de(i, j) = gradient[j];
        if (viscous) r.dep(i, j) = gradient[j + (elastic ? N : 0)];
      }
    }
  }

 private:
  LawType type_;
  std::vector<ExpressionPtr> expressions_;  ///< (N) of e then ε̇, as far as the type has them
  Prestress<N> pre_;
};

void read_names(Card& card, const char* keyword, int n, std::vector<std::string>& names) {
  if (!card.keyword(keyword))
    card.fail_expected(std::string("symbolic law: `") + keyword + "` expected");
  for (int i = 0; i < n; ++i) {
    names.push_back(card.quoted("name of a strain component"));
    for (std::size_t k = 0; k + 1 < names.size(); ++k)
      if (names[k] == names.back())
        card.fail("symbolic law: the name \"" + names.back() + "\" is used twice");
  }
}

template <int N, LawType type>
LawPtr<N> read_symbolic(Card& card) {
  std::vector<std::string> names;
  if (type != LawType::viscous) read_names(card, "epsilon", N, names);
  if (type != LawType::elastic) read_names(card, "epsilon prime", N, names);
  if (!card.keyword("expression")) card.fail_expected("symbolic law: `expression` expected");
  std::vector<ExpressionPtr> expressions;
  for (int i = 0; i < N; ++i)
    expressions.push_back(card.expression_of(card.quoted("expression"), names));
  return std::make_shared<SymbolicLaw<N>>(type, std::move(expressions), read_prestress<N>(card));
}

template <int N>
void register_symbolic(Registry& r) {
  add_law<N>(r, {"symbolic elastic"}, read_symbolic<N, LawType::elastic>);
  add_law<N>(r, {"symbolic viscous"}, read_symbolic<N, LawType::viscous>);
  add_law<N>(r, {"symbolic viscoelastic"}, read_symbolic<N, LawType::viscoelastic>);
  add_law<N>(r, {"symbolic"}, read_symbolic<N, LawType::viscoelastic>);
}

}  // namespace

void register_symbolic_laws(Registry& r) {
  register_symbolic<1>(r);
  register_symbolic<3>(r);
  register_symbolic<6>(r);
}

}  // namespace mbcosim
