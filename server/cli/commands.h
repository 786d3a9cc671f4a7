/// The subcommands of `mbcosim`, each in its own file. They link the engine alone.
#pragma once

#include <string>

namespace mbcosim::cli {

/// Exit codes of `mbcosim`, the same for every subcommand.
enum ExitCode {
  kDone = 0,
  kDeckRefused = 2,
  kNumericalFailure = 3,
  kRefused = 4,
  kInterrupted = 130
};

struct RunOptions {
  std::string deck;    ///< path of the main file
  std::string prefix;  ///< of the result files; empty: the deck's path
  bool quiet = false;
};

int run(const RunOptions& options);
int validate(const std::string& deck, bool json);
int describe(const std::string& deck, bool json);
/// The words of the input language, served or refused by name.
int keywords(bool json);

}  // namespace mbcosim::cli
