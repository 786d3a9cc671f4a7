#include "elements/user/readers.h"

#include <cmath>
#include <string>

namespace mbcosim {

void read_help(Card& card, const char* grammar) {
  if (!card.keyword("help")) return;
  card.warn(std::string("help: ") + grammar);
  if (!card.more()) card.fail("nothing follows `help`", grammar, "missing-argument");
}

double read_positive(Card& card, const char* what) {
  const double value = card.real(what);
  if (!(value > 0) || !std::isfinite(value))
    card.fail(std::string("the ") + what + " must be positive, got " + std::to_string(value));
  return value;
}

}  // namespace mbcosim
