/// The card `eigenanalysis` (MBDyn input manual, "Problems").
#include "input/cards.h"
#include "model/model.h"
#include "model/suffix_format.h"

namespace mbcosim {

namespace {

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

/// Digits and blanks that somebody could read.
int few(DeckCard& card, const char* what, int least) {
  constexpr int kMost = 99;
  const int n = card.integer_at_least(what, least);
  if (n > kMost)
    card.fail(std::string(what) + " must be at most " + std::to_string(kMost) + ", got " +
              std::to_string(n));
  return n;
}

void read_eigen_option(DeckCard& card, EigenSettings& e) {
  using Balance = EigenSettings::Balance;
  // MBDyn permutes when it is to scale, too.
  constexpr Balance kBalance[] = {Balance::no, Balance::permute, Balance::all, Balance::all};
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
      e.matrix_precision = few(card, "matrix output precision", 1);
      break;
    case 7:
      e.results_precision = few(card, "results output precision", 1);
      break;
    case 8:
      e.upper_frequency = card.real_above("upper frequency limit", 0, true);
      break;
    case 9:
      e.lower_frequency = card.real_above("lower frequency limit", 0, true);
      break;
    case 10:
      e.suffix_width = card.keyword("compute") ? -1 : few(card, "suffix width", 0);
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

}  // namespace

void read_eigenanalysis(DeckCard& card) {
  EigenSettings e;
  read_eigen_times(card, e);
  while (card.more()) read_eigen_option(card, e);
  if (!e.is_dense() && e.ncv <= e.nev)
    card.fail("the number of basis vectors must be greater than the number of eigenvalues");
  std::optional<EigenSettings>& kept = card.model().initial_value.eigenanalysis;
  if (kept)
    card.warn_at(card.head(), "the eigenanalysis card before this one has no effect",
                 "give the times in one card: `eigenanalysis: list, 2, <t1>, <t2>`");
  kept = std::move(e);
}

}  // namespace mbcosim
