/// Cards of the `data` and `initial value` blocks (MBDyn input manual, "Problems").
#include <cmath>
#include <limits>
#include <map>

#include "input/cards.h"
#include "input/deck.h"
#include "input/suggest.h"

namespace mbcosim {

namespace {

InitialValueSettings& settings(DeckCard& card) { return card.model().initial_value; }

// ------------------------------------------------------------------------------------------------
// time

double read_time(DeckCard& card, const char* what) {
  const double time = card.real(what);
  if (!std::isfinite(time)) card.fail(std::string(what) + " must be a finite number");
  return time;
}

void read_initial_time(DeckCard& card) {
  settings(card).initial_time = read_time(card, "initial time");
}

void read_final_time(DeckCard& card) {
  settings(card).final_time =
      card.keyword("forever") ? std::numeric_limits<double>::infinity() : card.real("final time");
  if (std::isnan(settings(card).final_time))
    card.fail("final time must be a number", "write `forever` for a run without an end");
  card.deck().final_time_where = card.last();
}

void read_time_step(DeckCard& card) {
  double h = read_time(card, "time step");
  if (h == 0) card.fail("time step must not be zero", "write a positive length");
  if (h < 0) {
    card.warn("time step is negative, its modulus is used", "write a positive length");
    h = -h;
  }
  settings(card).time_step = h;
}

void read_min_time_step(DeckCard& card) {
  settings(card).min_time_step = card.real_above("min time step", 0, false);
}

void read_max_time_step(DeckCard& card) {
  InitialValueSettings& s = settings(card);
  s.max_time_step = card.keyword("unlimited") ? nullptr : card.drive("max time step");
  if (!card.keyword("hard limit")) return;
  card.yes_no("hard limit");
  card.note("`hard limit` has no effect: the strategy treats the limit in one way");
}

void read_strategy(DeckCard& card) {
  InitialValueSettings& s = settings(card);
  card.deck().strategy_where = card.head();
  switch (card.required("strategy", {"no change", "factor", "change"})) {
    case 0:
      s.strategy = StepStrategy::no_change;
      return;
    case 2:
      s.strategy = StepStrategy::change;
      s.strategy_change = card.drive("time step");
      return;
    default:
      break;
  }
  s.strategy = StepStrategy::factor;
  s.reduction = card.real_above("reduction factor", 0, false);
  if (s.reduction > 1) card.fail("reduction factor must not be greater than 1");
  s.steps_before_reduction = card.integer_at_least("steps before reduction", 1);
  s.raise = card.real_above("raise factor", 1, true);
  s.steps_before_raise = card.integer_at_least("steps before raise", 1);
  s.min_iterations = card.integer_at_least("min iterations", 1);
  s.max_iterations_factor = card.more() ? card.integer_at_least("max iterations", 1)
                                        : 0;  // that of the card `max iterations`
}

// ------------------------------------------------------------------------------------------------
// convergence

ResidualTest read_test(DeckCard& card) {
  constexpr ResidualTest kinds[] = {ResidualTest::none, ResidualTest::norm, ResidualTest::minmax};
  return kinds[card.required("convergence test", {"none", "norm", "minmax"})];
}

void read_tolerance(DeckCard& card) {
  InitialValueSettings& s = settings(card);
  const SourceSpan start = card.more() ? card.next() : card.last();
  double rtol = card.keyword("null") ? 0 : card.real("tolerance");
  ResidualTest residual_test = ResidualTest::norm;
  s.scale_residual = false;
  if (card.keyword("test")) {
    residual_test = read_test(card);
    s.scale_residual = card.keyword("scale");
    if (s.scale_residual && residual_test == ResidualTest::none) {
      card.warn("scale has no effect without a residual test");
      s.scale_residual = false;
    }
  }
  double stol = 0;
  ResidualTest solution_test = ResidualTest::none;
  if (card.more()) {
    if (card.peek_word() == "scale")
      card.fail_at(card.next(), "\"scale\" must follow the kind of test: test, norm, scale");
    stol = card.keyword("null") ? 0 : card.real("solution tolerance");
    if (stol < 0) {
      card.warn("solution tolerance is negative: no solution test");
      stol = 0;
    }
    if (stol != 0) solution_test = ResidualTest::norm;
    if (card.keyword("test")) solution_test = read_test(card);
  }
  if (rtol < 0) {
    card.warn_at(start, "tolerance is negative, 1e-6 is used");
    rtol = 1e-6;
  }
  if (rtol == 0) residual_test = ResidualTest::none;
  if (stol == 0) solution_test = ResidualTest::none;
  if (residual_test == ResidualTest::none && solution_test == ResidualTest::none)
    card.fail_at(start, "solution tolerance required when the residual test is off");
  s.tolerance = rtol;
  s.residual_test = residual_test;
  s.solution_tolerance = stol;
  s.solution_test = solution_test;
}

int read_iterations(DeckCard& card, const char* what) {
  const int n = card.integer(what);
  if (n >= 1) return n;
  card.warn(std::string(what) + " is less than 1, 1 is used");
  return 1;
}

void read_max_iterations(DeckCard& card) {
  settings(card).max_iterations = read_iterations(card, "max iterations");
  settings(card).at_most = card.keyword("at most");
}

void read_modify_residual_test(DeckCard& card) { settings(card).modify_residual_test = true; }

void read_max_residual(DeckCard& card) {
  InitialValueSettings& s = settings(card);
  if (card.keyword("differential equations"))
    s.max_residual_differential = card.real_above("max residual", 0, false);
  const bool all = card.keyword("all equations");
  if (all || card.more()) s.max_residual = card.real_above("max residual", 0, false);
}

void read_enforce(DeckCard& card) {
  InitialValueSettings& s = settings(card);
  s.constraint_violations =
      card.required("form of the constraint equations",
                    {"constraint violations", "constraint violation rates"}) == 0;
  if (card.keyword("scale factor")) s.constraint_scale = card.real("scale factor");
}

// ------------------------------------------------------------------------------------------------
// derivatives, dummy steps

double read_tolerance_above_zero(DeckCard& card, const char* what, double fallback) {
  const double x = card.real(what);
  if (x > 0) return x;
  card.warn(std::string(what) + " must be greater than 0, the default is used");
  return fallback;
}

void read_derivatives_tolerance(DeckCard& card) {
  settings(card).derivatives_tolerance =
      read_tolerance_above_zero(card, "derivatives tolerance", 1e-6);
  if (!card.more()) return;
  card.real("tolerance of the solution");
  card.note("derivatives tolerance: the residual is tested, not the solution");
}
void read_derivatives_iterations(DeckCard& card) {
  settings(card).derivatives_max_iterations = read_iterations(card, "derivatives max iterations");
}

void read_derivatives_coefficient(DeckCard& card) {
  InitialValueSettings& s = settings(card);
  s.derivatives_auto = card.keyword("auto");
  if (!s.derivatives_auto) {
    s.derivatives_coefficient = read_tolerance_above_zero(card, "derivatives coefficient", 1e-6);
    s.derivatives_auto = card.keyword("auto");
  }
  if (!s.derivatives_auto) return;
  if (card.keyword("max iterations"))
    s.derivatives_auto_iterations = card.integer_at_least("max iterations", 0);
  if (card.keyword("factor")) s.derivatives_auto_factor = card.real_above("factor", 1, false);
}

void read_dummy_number(DeckCard& card) {
  settings(card).dummy_steps = card.integer_at_least("dummy steps number", 0);
}
void read_dummy_ratio(DeckCard& card) {
  settings(card).dummy_ratio = card.real_above("dummy steps ratio", 0, true);
  if (settings(card).dummy_ratio > 1) card.warn("dummy steps ratio is greater than 1");
}
void read_dummy_tolerance(DeckCard& card) {
  settings(card).dummy_tolerance = card.real_above("dummy steps tolerance", 0, false);
}
void read_dummy_iterations(DeckCard& card) {
  settings(card).dummy_max_iterations = read_iterations(card, "dummy steps max iterations");
}
void read_dummy_method(DeckCard& card) {
  if (settings(card).dummy_method) card.fail_at(card.head(), "dummy steps method is set twice");
  settings(card).dummy_method = read_method(card);
}

// ------------------------------------------------------------------------------------------------
// methods and solvers

void read_method_card(DeckCard& card) {
  Deck& deck = card.deck();
  if (deck.method_set)
    card.fail_at(card.head(), "method already set at " + deck.reading.place(deck.method_where));
  settings(card).method = read_method(card);
  deck.method_set = true;
  deck.method_where = card.head();
}

// ------------------------------------------------------------------------------------------------
// output and control of the run

/// Options of an output item: `matrix condition number, norm, inf`, `solver condition number, stat,
/// yes`.
void read_condition_number_options(DeckCard& card) {
  if (card.keyword("norm") && card.one_of({"inf"}) < 0) card.real("norm");
  if (card.keyword("stat")) card.yes_no("stat");
}

void read_output(DeckCard& card) {
  static const std::vector<std::string> kItems = {"none",
                                                  "iterations",
                                                  "residual",
                                                  "solution",
                                                  "jacobian",
                                                  "jacobian matrix",
                                                  "bailout",
                                                  "messages",
                                                  "counter",
                                                  "cpu time",
                                                  "matrix condition number",
                                                  "solver condition number",
                                                  "solver condition number statistics"};
  bool asks = false;
  while (card.more()) {
    switch (card.one_of({"none", "iterations", "residual", "solution", "jacobian",
                         "jacobian matrix", "bailout", "messages", "counter", "cpu time",
                         "matrix condition number", "solver condition number"})) {
      case 0:
        asks = settings(card).messages = false;
        break;
      case 7:
        settings(card).messages = true;
        break;
      case 10:
      case 11:
        read_condition_number_options(card);
        asks = true;
        break;
      case -1: {
        const std::string word = card.word("output item");
        card.warn("unknown item \"" + word + "\" ignored", suggestion(word, kItems));
        break;
      }
      default:
        asks = true;
        break;
    }
  }
  if (asks)
    card.note(std::string("nothing is printed during the iterations; `.out` has ") +
              (settings(card).messages ? "their number and the residual of each step"
                                       : "no line of a step without `messages`"));
}

void read_abort_after(DeckCard& card) {
  using Abort = InitialValueSettings::AbortAfter;
  constexpr Abort kinds[] = {Abort::input, Abort::assembly, Abort::derivatives, Abort::dummy_steps,
                             Abort::dummy_steps};
  const int kind = card.required(
      "phase", {"input", "assembly", "derivatives", "dummy steps", "fictitious steps"});
  if (kind == 4) warn_old_name(card, card.last(), "dummy steps");
  settings(card).abort_after = kinds[kind];
}

void read_output_meter(DeckCard& card) {
  card.drive("output meter");
  card.note("the output meter of this block has no effect");
}
void read_threads(DeckCard& card) {
  if (card.one_of({"auto", "disable"}) >= 0) return;
  card.one_of({"assembly", "solver"});
  card.integer_at_least("number of threads", 1);
}
void read_real_time(DeckCard& card) {
  ignore_rest(card, "a deck sets no pace; `mbcosim run --real-time` holds a run to the clock");
}

using Reader = void (*)(DeckCard&);
const std::vector<std::pair<const char*, Reader>>& initial_value_cards() {
  static const std::vector<std::pair<const char*, Reader>> kCards = {
      {"initial time", read_initial_time},
      {"final time", read_final_time},
      {"time step", read_time_step},
      {"min time step", read_min_time_step},
      {"max time step", read_max_time_step},
      {"strategy", read_strategy},
      {"tolerance", read_tolerance},
      {"max iterations", read_max_iterations},
      {"modify residual test", read_modify_residual_test},
      {"max residual", read_max_residual},
      {"enforce constraint equations", read_enforce},
      {"derivatives tolerance", read_derivatives_tolerance},
      {"derivatives max iterations", read_derivatives_iterations},
      {"derivatives coefficient", read_derivatives_coefficient},
      {"dummy steps number", read_dummy_number},
      {"dummy steps ratio", read_dummy_ratio},
      {"dummy steps tolerance", read_dummy_tolerance},
      {"dummy steps max iterations", read_dummy_iterations},
      {"dummy steps method", read_dummy_method},
      {"fictitious steps number", read_dummy_number},
      {"fictitious steps ratio", read_dummy_ratio},
      {"fictitious steps tolerance", read_dummy_tolerance},
      {"fictitious steps max iterations", read_dummy_iterations},
      {"fictitious steps method", read_dummy_method},
      {"method", read_method_card},
      {"nonlinear solver", read_nonlinear_solver},
      {"newton raphson", read_legacy_newton},
      {"linear solver", read_linear_solver},
      {"solver", read_linear_solver},
      {"output", read_output},
      {"output meter", read_output_meter},
      {"abort after", read_abort_after},
      {"eigenanalysis", read_eigenanalysis},
      {"threads", read_threads},
      {"real time", read_real_time},
      {"interface linear solver", ignore_card},
      {"interface solver", ignore_card},
      {"pod", ignore_card},
  };
  return kCards;
}

}  // namespace

void read_data_card(DeckCard& card) {
  const std::string& word = card.statement().word;
  if (word != "problem" && word != "integrator") fail_unknown_card(card, {"problem"});
  if (word == "integrator") warn_old_name(card, card.head(), "problem");
  switch (card.required(
      "problem", {"initial value", "multistep", "inverse dynamics", "parallel initial value"})) {
    case 2:
      card.deck().inverse_dynamics = true;
      break;
    case 3:
      card.fail_unsupported(card.last(), "parallel initial value", "problem");
    case 1:
      warn_old_name(card, card.last(), "initial value");
      [[fallthrough]];
    default:
      card.deck().inverse_dynamics = false;
  }
  card.expect_end();
}

std::vector<std::string> initial_value_words() {
  std::vector<std::string> words;
  for (const auto& c : initial_value_cards()) words.emplace_back(c.first);
  return words;
}

void read_initial_value_card(DeckCard& card) {
  static const std::map<std::string, Reader, std::less<>> kReaders = [] {
    std::map<std::string, Reader, std::less<>> m;
    for (const auto& c : initial_value_cards()) m[normalized(c.first)] = c.second;
    return m;
  }();
  const auto found = kReaders.find(card.statement().word);
  if (found == kReaders.end()) {
    fail_unknown_card(card, initial_value_words());
  }
  constexpr std::string_view fictitious = "fictitious";
  if (found->first.starts_with(fictitious))
    warn_old_name(card, card.head(), "dummy" + card.card_name().substr(fictitious.size()));
  if (found->first == "solver") warn_old_name(card, card.head(), "linear solver");
  if (found->first == "newtonraphson")
    warn_old_name(card, card.head(), "nonlinear solver: newton raphson");
  found->second(card);
  card.expect_end();
}

}  // namespace mbcosim
