/// Cards of the `data` and `initial value` blocks (MBDyn input manual, "Problems").
#include <limits>
#include <map>
#include <set>

#include "input/cards.h"
#include "input/deck.h"
#include "input/suggest.h"
#include "model/suffix_format.h"

namespace mbcosim {

namespace {

InitialValueSettings& settings(DeckCard& card) { return card.model().initial_value; }

// ------------------------------------------------------------------------------------------------
// time

void read_initial_time(DeckCard& card) { settings(card).initial_time = card.real("initial time"); }

void read_final_time(DeckCard& card) {
  settings(card).final_time =
      card.keyword("forever") ? std::numeric_limits<double>::infinity() : card.real("final time");
  card.deck().final_time_where = card.last();
}

void read_time_step(DeckCard& card) {
  double h = card.real("time step");
  if (h == 0) card.fail("time step must not be zero");
  if (h < 0) {
    card.warn("time step is negative, its modulus is used");
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
  if (card.keyword("hard limit")) s.max_time_step_hard = card.yes_no("hard limit");
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
    card.fail_at(card.head(), "method already set at " + deck.session.place(deck.method_where));
  settings(card).method = read_method(card);
  deck.method_set = true;
  deck.method_where = card.head();
}

/// `true | modified, n, ...`; `default_every`: n when it may be left out, else 0.
void read_newton(DeckCard& card, int default_every) {
  InitialValueSettings& s = settings(card);
  s.modified_newton = s.keep_jacobian = false;
  s.jacobian_every = 1;
  if (!card.more()) return;
  const int kind = card.one_of({"true", "modified"});
  if (kind < 0 && default_every == 0)
    card.required("kind of Newton iteration", {"true", "modified"});
  if (kind < 0) {
    card.warn_at(card.next(),
                 "unknown kind of Newton iteration \"" + card.peek_word() + "\", true is used");
    card.skip();
  }
  if (kind != 1) return;
  s.modified_newton = true;
  s.jacobian_every = card.more() || default_every == 0
                         ? card.integer_at_least("iterations between Jacobians", 1)
                         : default_every;
  const int keep = card.one_of({"keep jacobian matrix", "keep jacobian"});
  s.keep_jacobian = keep >= 0;
  if (keep == 1) warn_old_name(card, card.last(), "keep jacobian matrix");
  card.keyword("honor element requests");
}

void read_legacy_newton(DeckCard& card) {
  settings(card).line_search.reset();
  read_newton(card, 2);
}

/// One option of the line search; false when the next word is none.
bool read_line_search_option(DeckCard& card, LineSearchSettings& l) {
  switch (card.one_of({"tolerance x", "tolerance min", "max iterations", "alpha", "lambda min",
                       "lambda factor min", "max step", "zero gradient", "divergence check",
                       "algorithm", "scale newton step", "print convergence info", "verbose",
                       "abort at lambda min", "non negative slope continue"})) {
    case 0:
      l.tolerance_x = card.real_above("tolerance x", 0, true);
      return true;
    case 1:
      l.tolerance_min = card.real_above("tolerance min", 0, true);
      return true;
    case 2:
      l.max_iterations = card.integer_at_least("max iterations", 0);
      return true;
    case 3:
      l.alpha = card.real_above("alpha", 0, true);
      return true;
    case 4:
      l.lambda_min = card.real_above("lambda min", 0, true);
      if (card.keyword("relative")) l.lambda_min_relative = card.yes_no("relative");
      return true;
    case 5:
      l.lambda_factor_min = card.real_above("lambda factor min", 0, false);
      if (l.lambda_factor_min >= 1) card.fail("lambda factor min must be less than 1");
      return true;
    case 6:
      l.max_step = card.real_above("max step", 0, false);
      return true;
    case 7:
      card.required("zero gradient option", {"continue"});
      l.zero_gradient_continue = card.yes_no("continue");
      return true;
    case 8:
      l.divergence_check = card.yes_no("divergence check");
      if (card.keyword("factor")) l.divergence_factor = card.real_above("factor", 0, false);
      return true;
    case 9:
      l.cubic = card.required("algorithm", {"cubic", "factor"}) == 0;
      return true;
    case 10:
      l.scale_newton_step = card.yes_no("scale newton step");
      if (card.keyword("min scale")) l.min_scale = card.real_above("min scale", 0, true);
      if (l.min_scale > 1) card.fail("min scale must not be greater than 1");
      return true;
    case 11:
      card.yes_no("print convergence info");
      return true;
    case 12:
      card.yes_no("verbose");
      return true;
    case 13:
      l.abort_at_lambda_min = card.yes_no("abort at lambda min");
      return true;
    case 14:
      l.non_negative_slope_continue = card.yes_no("non negative slope continue");
      return true;
    default:
      return false;
  }
}

void read_line_search(DeckCard& card) {
  InitialValueSettings& s = settings(card);
  if (card.peek_word() == "true" || card.peek_word() == "modified") read_newton(card, 0);
  LineSearchSettings l;
  while (read_line_search_option(card, l)) {
  }
  s.line_search = l;
}

void read_matrix_free(DeckCard& card) {
  card.required("matrix free solver", {"default", "bicgstab", "gmres"});
  while (card.more()) {
    switch (card.required("matrix free option",
                          {"tolerance", "steps", "tau", "eta", "preconditioner"})) {
      case 1:
        card.integer("steps");
        break;
      case 4:
        if (card.required("preconditioner", {"full jacobian matrix", "full jacobian"}) == 1)
          warn_old_name(card, card.last(), "full jacobian matrix");
        if (card.keyword("steps")) card.integer("steps");
        card.keyword("honor element requests");
        break;
      default:
        card.real("value");
    }
  }
  card.note("matrix free solvers are replaced by Newton iterations with a direct solver");
}

void read_nonlinear_solver(DeckCard& card) {
  settings(card).line_search.reset();
  switch (card.required("nonlinear solver",
                        {"newton raphson", "line search", "matrix free", "default"})) {
    case 0:
      read_newton(card, 0);
      return;
    case 1:
      read_line_search(card);
      return;
    case 2:
      read_matrix_free(card);
      return;
    default:
      return;
  }
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
  InitialValueSettings& s = settings(card);
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
  while (card.more()) {
    switch (card.one_of({"none", "iterations", "residual", "solution", "jacobian",
                         "jacobian matrix", "bailout", "messages", "counter", "cpu time",
                         "matrix condition number", "solver condition number"})) {
      case 0:
        s.output_iterations = s.output_residual = s.output_solution = s.output_jacobian = false;
        break;
      case 1:
        s.output_iterations = true;
        break;
      case 2:
        s.output_residual = true;
        break;
      case 3:
        s.output_solution = true;
        break;
      case 4:
      case 5:
        s.output_jacobian = true;
        break;
      case 10:
      case 11:
        read_condition_number_options(card);
        break;
      case -1: {
        const std::string word = card.word("output item");
        card.warn("unknown item \"" + word + "\" ignored", suggestion(word, kItems));
        break;
      }
      default:
        break;
    }
  }
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

void read_eigen_times(DeckCard& card, EigenSettings& e) {
  const int n = card.keyword("list") ? card.integer_at_least("number of times", 1) : 1;
  for (int i = 0; i < n; ++i) {
    e.times.push_back(card.real("time"));
    if (i > 0 && !(e.times[i] > e.times[i - 1])) card.fail("the times must increase");
  }
}

void read_iterative_eigensolver(DeckCard& card, EigenSettings& e, EigenSettings::Solver solver) {
  e.solver = solver;
  e.nev = card.integer_at_least("number of eigenvalues", 1);
  e.ncv = card.integer_at_least("number of basis vectors", 1);
  e.tolerance = card.real_above("tolerance", 0, true);
}

void read_eigen_option(DeckCard& card, EigenSettings& e) {
  using Balance = EigenSettings::Balance;
  constexpr Balance kBalance[] = {Balance::no, Balance::permute, Balance::scale, Balance::all};
  switch (card.required(
      "option",
      {"parameter", "output matrices", "output full matrices", "output sparse matrices",
       "output eigenvectors", "output geometry", "matrix output precision",
       "results output precision", "upper frequency limit", "lower frequency limit", "suffix width",
       "suffix format", "use lapack", "use arpack", "use jdqz", "balance"})) {
    case 0:
      e.parameter = card.real_above("parameter", 0, false);
      break;
    case 1:
    case 2:
      e.matrices_full = true;
      break;
    case 3:
      e.matrices_sparse = true;
      break;
    case 4:
      e.eigenvectors = true;
      break;
    case 5:
      e.geometry = true;
      break;
    case 6:
      e.matrix_precision = card.integer_at_least("matrix output precision", 1);
      break;
    case 7:
      e.results_precision = card.integer_at_least("results output precision", 1);
      break;
    case 8:
      e.upper_frequency = card.real_above("upper frequency limit", 0, true);
      break;
    case 9:
      e.lower_frequency = card.real_above("lower frequency limit", 0, true);
      break;
    case 10:
      e.suffix_width = card.keyword("compute") ? -1 : card.integer_at_least("suffix width", 0);
      break;
    case 11:
      e.suffix_format = card.quoted("suffix format");
      if (!SuffixFormat::parse(e.suffix_format))
        card.fail("suffix format \"" + e.suffix_format + "\" is not a format of one integer",
                  "\"%02d\" or \"%0*d\", for instance");
      break;
    case 12:
      e.solver = EigenSettings::Solver::lapack;
      break;
    case 13:
      read_iterative_eigensolver(card, e, EigenSettings::Solver::arpack);
      break;
    case 14:
      read_iterative_eigensolver(card, e, EigenSettings::Solver::jdqz);
      break;
    default:
      e.balance = kBalance[card.required("balance", {"no", "permute", "scale", "all"})];
  }
}

void read_eigenanalysis(DeckCard& card) {
  EigenSettings e;
  read_eigen_times(card, e);
  while (card.more()) read_eigen_option(card, e);
  if (e.solver == EigenSettings::Solver::lapack || e.ncv > e.nev) {
    settings(card).eigenanalyses.push_back(std::move(e));
    return;
  }
  card.fail("the number of basis vectors must be greater than the number of eigenvalues");
}

void read_output_meter(DeckCard& card) {
  card.drive("output meter");
  card.note("the output meter of this block has no effect");
}
void read_threads(DeckCard& card) {
  if (card.one_of({"auto", "disable"}) >= 0) return;
  card.one_of({"assembly", "solver"});
  card.integer("number of threads");
}
void ignored(DeckCard& card) { ignore_rest(card, "this card has no effect"); }

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
      {"real time", ignored},
      {"interface linear solver", ignored},
      {"interface solver", ignored},
      {"pod", ignored},
  };
  return kCards;
}

}  // namespace

MethodSettings read_method(DeckCard& card) {
  MethodSettings m;
  const int kind =
      card.required("integration method", {"crank nicolson", "crank nicholson", "ms", "nostro",
                                           "hope", "third order", "bdf", "implicit euler"});
  switch (kind) {
    case 0:
    case 1:
      m.method = Method::crank_nicolson;
      break;
    case 2:
    case 3:
    case 4:
      if (kind == 3) warn_old_name(card, card.last(), "ms");
      m.method = kind == 4 ? Method::hope : Method::multistep;
      m.rho = card.drive("differential radius");
      m.rho_algebraic = card.more() ? card.drive("algebraic radius") : m.rho;
      break;
    case 5:
      m.method = Method::third_order;
      if (card.keyword("ad hoc"))
        m.method = Method::third_order_ad_hoc;
      else
        m.rho = card.drive("radius");
      break;
    case 6:
      if (card.keyword("order")) {
        const int order = card.integer("order");
        if (order != 1 && order != 2)
          card.fail("bdf: order must be 1 or 2, got " + std::to_string(order));
        if (order == 1) m.method = Method::bdf1;
      }
      break;
    default:
      m.method = Method::bdf1;
  }
  return m;
}

void read_linear_solver(DeckCard& card) {
  const SourceSpan where = card.more() ? card.next() : card.last();
  const int solver = card.required(
      "linear solver", {"umfpack", "umfpack3", "klu", "naive", "lapack", "y12", "superlu", "taucs",
                        "harwell", "meschach", "watson", "pardiso", "empty"});
  if (solver == 12) card.fail_at(where, "the linear solver \"empty\" solves nothing");
  static const std::set<std::string, std::less<>> kFlags = {
      "map",          "cc",     "columncompressed", "dir",
      "directaccess", "colamd", "minimumdegree",    "rcmk",
      "king",         "sloan",  "nesteddissection", "mmdata"};
  while (card.more()) {
    if (kFlags.count(card.peek_word())) {
      card.skip();
    } else if (card.one_of(
                   {"mt", "multi thread", "workspace size", "block size", "max iterations"}) >= 0) {
      card.integer("linear solver option");
    } else if (card.one_of({"pivot factor", "drop tolerance", "tolerance"}) >= 0) {
      card.real("linear solver option");
    } else {
      card.required("linear solver option", {"scale"});
      card.required("scaling",
                    {"no", "none", "max", "sum", "row max", "row sum", "column max", "column sum",
                     "row max column max", "lapack", "iterative", "always", "once"});
      card.one_of({"always", "once", "never"});
    }
  }
}

void read_data_card(DeckCard& card) {
  const std::string& word = card.statement().word;
  if (word != "problem" && word != "integrator") fail_unknown_card(card, {"problem"});
  if (word == "integrator") warn_old_name(card, card.head(), "problem");
  switch (card.required(
      "problem", {"initial value", "multistep", "inverse dynamics", "parallel initial value"})) {
    case 2:
      card.deck().inverse_dynamics = true;
      card.fail_unsupported(card.last(), "inverse dynamics", "problem");
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
