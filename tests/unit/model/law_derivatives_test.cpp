/// Every constitutive law in every dimension: it is read, and its tangent is the derivative of its
/// force.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "deck_run.h"
#include "elements/genels/scalar_genels.h"
#include "elements/joints/deformable.h"
#include "input/word_cards.h"

namespace mbcosim::law_derivatives_test {
namespace {

template <class Element>
auto law_in(const Model& model, Family family, int label) {
  const ElementRef e = model.find_element(family, label);
  return dynamic_cast<const ElementSetOf<Element>&>(*e.set).element(e.index).law;
}

template <int N>
void expect_exact_tangent(const Law<N>& law, const EvalContext& context) {
  VecN<N> strain, rate;
  for (int i = 0; i < N; ++i) {
    strain(i) = .23 - .07 * i;
    rate(i) = -.41 + .13 * i;
  }
  typename Law<N>::Response at, plus, minus;
  law.respond(context, strain, rate, true, at);
  EXPECT_TRUE(at.f.allFinite());
  const double h = 1e-6;
  const double scale = std::max({1.0, at.de.cwiseAbs().maxCoeff(), at.dep.cwiseAbs().maxCoeff()});
  for (int j = 0; j < N; ++j) {
    const VecN<N> step = h * VecN<N>::Unit(j);
    law.respond(context, strain + step, rate, false, plus);
    law.respond(context, strain - step, rate, false, minus);
    EXPECT_LT(((plus.f - minus.f) / (2 * h) - at.de.col(j)).norm(), 2e-8 * scale)
        << "by strain " << j + 1;
    law.respond(context, strain, rate + step, false, plus);
    law.respond(context, strain, rate - step, false, minus);
    EXPECT_LT(((plus.f - minus.f) / (2 * h) - at.dep.col(j)).norm(), 2e-8 * scale)
        << "by rate " << j + 1;
  }
}

template <class Element, int N>
void expect_exact_tangent_in(const std::map<std::string, std::string>& files, Family family) {
  DeckRun run(files);
  ASSERT_TRUE(run.ready());
  expect_exact_tangent<N>(*law_in<Element>(run.model(), family, 90), run.context());
}

void check(const decks::WordCard& card) {
  SCOPED_TRACE(card.card);
  const auto files = word_deck(card, decks::Bench::moving);
  switch (card.word[4]) {  // "law 3: ..."
    case '1':
      return expect_exact_tangent_in<GenelSpringSupport, 1>(files, Family::genel);
    case '3':
      return expect_exact_tangent_in<DeformableHinge, 3>(files, Family::joint);
    default:
      return expect_exact_tangent_in<DeformableJoint, 6>(files, Family::joint);
  }
}

TEST(LawDerivatives, OfEveryRegisteredLaw) {
  for (const decks::WordCard& card : decks::law_cards()) check(card);
}
TEST(LawDerivatives, OfALawThatIsANumber) {
  decks::WordCard card;
  card.word = "law 1: number";
  card.card = "genel: 90, spring support, 11, abstract, algebraic, 5.";
  check(card);
}

}  // namespace
}  // namespace mbcosim::law_derivatives_test
