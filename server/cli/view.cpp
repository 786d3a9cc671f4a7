/// mbcosim view: reads the deck, so that all that is wrong with it is told here, and hands over to
/// the program that starts a daemon for it.
#include <cstdio>

#include "cli/commands.h"

namespace mbcosim::cli {

int view(const std::string& deck, const std::string& http) {
  const int readable = validate(deck, {}, false);
  std::fflush(stdout);
  return readable == kDone ? hand_over("view", {deck, "--http", http}) : readable;
}

}  // namespace mbcosim::cli
