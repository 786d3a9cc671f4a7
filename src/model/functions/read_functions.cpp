#include "model/functions/readers.h"

#include <cmath>

#include "model/card.h"
#include "model/functions/scalar_functions.h"

namespace mbcosim {

namespace {

ScalarFunctionPtr read_linear(Card& card) {
  const double x1 = card.real("x1"), y1 = card.real("y1"), x2 = card.real("x2");
  if (x1 == x2) card.fail("linear: the two points have the same abscissa " + std::to_string(x1));
  const double y2 = card.real("y2");
  return std::make_shared<LineFunction>(x1, y1, (y2 - y1) / (x2 - x1));
}

/// [base, b,] [coefficient, c,] multiplier
struct Scale {
  double base = std::exp(1.0), coefficient = 1, multiplier = 1;
};
Scale read_scale(Card& card) {
  Scale s;
  if (card.keyword("base")) {
    s.base = card.real("base");
    if (!(s.base > 0) || s.base == 1)
      card.fail("the base must be positive and not 1, got " + std::to_string(s.base));
  }
  if (card.keyword("coefficient")) s.coefficient = card.real("coefficient");
  s.multiplier = card.real("multiplier");
  return s;
}

ScalarFunctionPtr read_exp(Card& card) {
  const Scale s = read_scale(card);
  return std::make_shared<ExponentialFunction>(s.multiplier, s.coefficient * std::log(s.base));
}
ScalarFunctionPtr read_log(Card& card) {
  const Scale s = read_scale(card);
  if (s.coefficient == 0) card.fail("log: the coefficient must not be zero");
  return std::make_shared<LogarithmFunction>(s.multiplier, s.base, s.coefficient);
}

/// [do not extrapolate,] x1, y1, … [, end]: `end` is needed only where more arguments follow
FunctionPoints read_points(Card& card, const char* what, std::size_t least) {
  FunctionPoints p;
  p.extrapolate = !card.keyword("do not extrapolate");
  while (card.more() && !card.keyword("end")) {
    const double x = card.real("abscissa");
    if (!p.x.empty() && !(x > p.x.back()))
      card.fail(std::string(what) + ": abscissa " + std::to_string(x) +
                " does not exceed the one before, " + std::to_string(p.x.back()));
    p.x.push_back(x);
    p.y.push_back(card.real("ordinate"));
  }
  if (p.x.size() < least)
    card.fail(std::string(what) + ": at least " + std::to_string(least) +
              " points are needed, got " + std::to_string(p.x.size()));
  return p;
}

ScalarFunctionPtr read_chebyshev(Card& card) {
  const double a = card.real("lower bound"), b = card.real("upper bound");
  if (!(b > a)) card.fail("chebychev: the upper bound must exceed the lower one");
  const bool extrapolate = !card.keyword("do not extrapolate");
  std::vector<double> c;
  while (card.more() && !card.keyword("end")) c.push_back(card.real("coefficient"));
  if (c.empty()) card.fail("chebychev: at least one coefficient is needed");
  return std::make_shared<ChebyshevFunction>(a, b, std::move(c), extrapolate);
}

Registry::FunctionReader combination(CombinedFunction::Operation operation) {
  return [operation](Card& card) -> ScalarFunctionPtr {
    ScalarFunctionPtr f = card.scalar_function();
    ScalarFunctionPtr g = card.scalar_function();
    return std::make_shared<CombinedFunction>(operation, std::move(f), std::move(g));
  };
}

}  // namespace

void register_functions(Registry& registry) {
  registry.function({"const"}, [](Card& card) {
    return std::make_shared<LineFunction>(0, card.real("value"), 0);
  });
  registry.function({"linear"}, read_linear);
  registry.function(
      {"pow"}, [](Card& card) { return std::make_shared<PowerFunction>(card.real("exponent")); });
  registry.function({"exp"}, read_exp);
  registry.function({"log"}, read_log);
  registry.function({"cubic spline"}, [](Card& card) {
    return std::make_shared<CubicSplineFunction>(read_points(card, "cubic spline", 3));
  });
  registry.function({"multilinear"}, [](Card& card) {
    return std::make_shared<MultilinearFunction>(read_points(card, "multilinear", 2));
  });
  registry.function({"chebychev"}, read_chebyshev);
  registry.function({"sum"}, combination(CombinedFunction::Operation::sum));
  registry.function({"sub"}, combination(CombinedFunction::Operation::difference));
  registry.function({"mul"}, combination(CombinedFunction::Operation::product));
  registry.function({"div"}, combination(CombinedFunction::Operation::quotient));
}

}  // namespace mbcosim
