/// Cards that choose integrators and solvers (MBDyn input manual, "Problems").
#include <set>

#include "input/cards.h"
#include "model/model.h"

namespace mbcosim {

namespace {

/// `true | modified, n, ...`; `default_every`: n when it may be left out, else 0.
void read_newton(DeckCard& card, int default_every) {
  InitialValueSettings& s = card.model().initial_value;
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

constexpr int kMostTrials = 1000;

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
      if (l.max_iterations > kMostTrials)
        card.fail("line search: at most " + std::to_string(kMostTrials) +
                  " iterations are allowed");
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
      card.yes_no("non negative slope continue");
      card.note(
          "`non negative slope continue` has no effect: along a correction the slope of the "
          "squared residual is taken as negative");
      return true;
    default:
      return false;
  }
}

void read_line_search(DeckCard& card) {
  InitialValueSettings& s = card.model().initial_value;
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

}  // namespace

void read_legacy_newton(DeckCard& card) {
  card.model().initial_value.line_search.reset();
  read_newton(card, 2);
}

void read_nonlinear_solver(DeckCard& card) {
  card.model().initial_value.line_search.reset();
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
      "linear solver",
      {"umfpack", "umfpack3", "klu", "naive", "lapack", "y12", "superlu", "taucs", "harwell",
       "meschach", "watson", "pardiso", "pastix", "strumpack", "spqr", "qr", "wsmp", "empty"});
  if (solver == 17) card.fail_at(where, "the linear solver \"empty\" solves nothing");
  static const std::set<std::string, std::less<>> kFlags = {
      "map",          "cc",     "columncompressed", "dir",
      "directaccess", "colamd", "minimumdegree",    "rcmk",
      "king",         "sloan",  "nesteddissection", "mmdata",
      "grad"};
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

}  // namespace mbcosim
