#include "elements/joints/friction.h"

namespace mbcosim {

namespace {

double read_coefficient(Card& card, const char* what) {
  const double value = card.real(what);
  if (!(value >= 0)) card.fail(std::string("modlugre friction: ") + what + " must not be negative");
  return value;
}

}  // namespace

Friction read_friction(Card& card) {
  Friction f;
  if (card.keyword("preload")) f.preload = card.real("preload");
  if (card.keyword("discrete coulomb"))
    card.fail("friction model `discrete coulomb` is not supported", "use `modlugre`");
  card.required("friction model", {"modlugre"});
  f.sigma0 = read_coefficient(card, "sigma 0");
  if (f.sigma0 == 0) card.fail("modlugre friction: sigma 0 must be positive");
  f.sigma1 = read_coefficient(card, "sigma 1");
  f.sigma2 = read_coefficient(card, "sigma 2");
  f.kappa = read_coefficient(card, "kappa");
  if (!(f.kappa < 1)) card.fail("modlugre friction: kappa must be smaller than 1");
  f.steady = card.scalar_function("friction function");
  if (card.keyword("screw joint"))
    card.fail("shape function `screw joint` is not supported", "use `simple`");
  f.shape = card.required("shape function", {"simple", "simple plane hinge"}) == 0
                ? Friction::Shape::simple
                : Friction::Shape::plane_hinge;
  return f;
}

}  // namespace mbcosim
