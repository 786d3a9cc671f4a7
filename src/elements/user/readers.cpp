#include "elements/user/readers.h"

#include <string>

namespace mbcosim {

void read_help(Card& card, const char* grammar) {
  if (!card.keyword("help")) return;
  card.warn(std::string("help: ") + grammar);
  if (!card.more()) card.fail("nothing follows `help`", grammar, "missing-argument");
}

}  // namespace mbcosim
