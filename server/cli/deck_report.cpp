#include "cli/deck_report.h"

#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <string_view>

namespace mbcosim::cli {

namespace fs = std::filesystem;

namespace {

/// The user's files; notes the names of those that were read.
class NotedFiles : public FolderSource {
 public:
  NotedFiles(const std::string& deck, std::vector<std::string>* read)
      : FolderSource(".", /*unrestricted=*/true),
        deck_(deck),
        main_(is_piped(deck) ? fs::path(deck).filename().string() : deck),
        read_(read) {}
  const std::string& main() const { return main_; }
  Result<std::string> read(const std::string& name) const override {
    const std::string& file = name == main_ ? deck_ : name;
    if (read_) read_->push_back(file);
    return FolderSource::read(file);
  }

 private:
  const std::string deck_, main_;  ///< where the deck is, what it is called
  std::vector<std::string>* read_;
};

/// On terminals, unless NO_COLOR is set (no-color.org).
bool shows_colours(std::FILE* out) {
  const char* none = std::getenv("NO_COLOR");
  const char* terminal = std::getenv("TERM");
  return ::isatty(::fileno(out)) != 0 && !(none && *none) &&
         !(terminal && std::string_view(terminal) == "dumb");
}

/// The first line bold with its severity in colour, carets green.
std::string coloured(const Diagnostic& diagnostic) {
  std::string text = diagnostic.text();
  const std::string severity = severity_name(diagnostic.severity) + std::string(":");
  const char* colour = diagnostic.severity == Severity::error     ? "\x1b[1;31m"
                       : diagnostic.severity == Severity::warning ? "\x1b[1;35m"
                                                                  : "\x1b[1;36m";
  if (const std::size_t at = text.find(severity); at != std::string::npos)
    text = "\x1b[1m" + text.substr(0, at) + colour + severity + "\x1b[0m" +
           text.substr(at + severity.size());
  for (std::size_t at = text.find('\n'); at != std::string::npos; at = text.find('\n', at + 1)) {
    const std::size_t mark = text.find_first_not_of(" \t", at + 1);
    const std::size_t end = text.find('\n', at + 1);
    if (mark == std::string::npos || text[mark] != '^') continue;
    text.insert(end == std::string::npos ? text.size() : end, "\x1b[0m");
    text.insert(mark, "\x1b[1;32m");
    break;
  }
  return text;
}

}  // namespace

bool is_piped(const std::string& deck) {
  std::error_code none;
  const fs::file_status status = fs::status(deck, none);
  return fs::is_fifo(status) || fs::is_character_file(status);
}

DeckReport load_path(const std::string& deck, const SymbolValues& symbols,
                     std::vector<std::string>* read) {
  const NotedFiles files(deck, read);
  return read_deck(files, files.main(), {.symbols = symbols});
}

void print_diagnostics(const std::vector<Diagnostic>& diagnostics, std::FILE* out) {
  const bool colours = shows_colours(out);
  for (const Diagnostic& d : diagnostics) {
    const std::string text = colours ? coloured(d) : d.text();
    std::fwrite(text.data(), 1, text.size(), out);
    if (text.empty() || text.back() != '\n') std::fputc('\n', out);
  }
}

ExitCode exit_code_of(const LoadReport& report) {
  if (report.ok()) return kDone;
  const auto any = [&](std::string_view code) {
    return std::any_of(report.diagnostics.begin(), report.diagnostics.end(),
                       [&](const Diagnostic& d) {
                         return d.severity == Severity::error && d.code.starts_with(code);
                       });
  };
  return any("internal") ? kInternalError : any("limit-") ? kRefused : kDeckRefused;
}

bool has_nothing_to_run(const LoadReport& report) {
  return report.ok() && report.model->unknowns == 0 && report.model->elements.empty() &&
         report.printed.empty();
}

void print_nothing_to_run(const std::string& deck, Severity severity, std::FILE* out) {
  std::fprintf(out,
               "%s: %s: there is nothing to run: the deck has no nodes and no elements\n"
               "  hint: a deck consists of the blocks data, initial value, control data, nodes "
               "and elements\n",
               deck.c_str(), severity_name(severity));
}

ExitCode exit_code_of(const Error& error) {
  switch (error.kind) {
    case ErrorKind::deck:
      return kDeckRefused;
    case ErrorKind::not_converged:
    case ErrorKind::singular:
    case ErrorKind::evaluation:
    case ErrorKind::peer:
      return kNumericalFailure;
    case ErrorKind::internal:
      return kInternalError;
    case ErrorKind::cancelled:
      return kInterrupted;
    case ErrorKind::argument:
    case ErrorKind::precondition:
    case ErrorKind::limit:
    case ErrorKind::io:
    case ErrorKind::data_loss:
      return kRefused;
  }
  return kInternalError;
}

void print_error(const Error& error, std::FILE* out) {
  std::fprintf(out, "error: %s\n", error.message.c_str());
  print_diagnostics(error.diagnostics, out);
  const std::vector<double>& errors = error.failure.residual_history;
  if (errors.empty()) return;
  constexpr std::size_t kShown = 12;
  const std::size_t left_out = errors.size() > kShown ? errors.size() - kShown : 0;
  std::fprintf(out, "  residual norms of the iterations:");
  if (left_out > 0) std::fprintf(out, " (%zu before)", left_out);
  for (std::size_t k = left_out; k < errors.size(); ++k) std::fprintf(out, " %.4g", errors[k]);
  std::fputc('\n', out);
}

}  // namespace mbcosim::cli
