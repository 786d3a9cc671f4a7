/// mbcosim: runs and inspects decks on the command line.
#include <cerrno>
#include <charconv>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <new>
#include <optional>
#include <string_view>

#include "cli/commands.h"

namespace {

using namespace mbcosim::cli;

/// From 1 to kMostThreads; 0: it is no such number.
int threads_of(std::string_view text) {
  int threads = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), threads);
  const bool whole = error == std::errc() && end == text.data() + text.size();
  return whole && threads >= 1 && threads <= kMostThreads ? threads : 0;
}

/// `run DECK` with no other options than those that nearly all have, since the whole command line
/// takes longer to set up than a small deck to read. Nothing: whatever else it is.
std::optional<RunOptions> plain_run(int argc, char** argv) {
  if (argc < 3 || std::string_view(argv[1]) != "run") return std::nullopt;
  RunOptions options;
  for (int k = 2; k < argc; ++k) {
    const std::string_view word = argv[k], next = k + 1 < argc ? argv[k + 1] : "";
    const bool has_value = !next.empty() && next[0] != '-';
    if (word == "-q" || word == "--quiet") {
      options.quiet = true;
    } else if ((word == "-o" || word == "--output") && has_value && options.prefix.empty()) {
      options.prefix = next;
      ++k;
    } else if (const int threads = word == "--threads" ? threads_of(next) : 0; threads > 0) {
      options.threads = threads;
      ++k;
    } else if (!word.empty() && word[0] != '-' && options.deck.empty()) {
      options.deck = word;
    } else {
      return std::nullopt;
    }
  }
  return options.deck.empty() ? std::nullopt : std::make_optional(options);
}

/// What can go wrong with a deck is not thrown to here.
int guarded(int argc, char** argv) try {
  if (const auto options = plain_run(argc, argv)) return run(*options);
  return command_line(argc, argv);
} catch (const std::bad_alloc&) {
  std::fputs("error: out of memory\n", stderr);
  return kRefused;
} catch (const std::exception& e) {
  std::fprintf(stderr, "error: %s\n", e.what());
  return kInternalError;
}

/// A full device or a closed pipe: `exit_code` is no success then.
int finished(int exit_code) {
  if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return exit_code;
  std::fprintf(stderr, "error: cannot write to the standard output: %s\n", std::strerror(errno));
  return exit_code == kDone ? kRefused : exit_code;
}

}  // namespace

int main(int argc, char** argv) {
  // Files beyond their limit and closed pipes are errors of the calls that write.
  std::signal(SIGXFSZ, SIG_IGN);
  std::signal(SIGPIPE, SIG_IGN);
  return finished(guarded(argc, argv));
}
