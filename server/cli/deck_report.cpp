#include "cli/deck_report.h"

#include <algorithm>

namespace mbcosim::cli {

DeckReport load_path(const std::string& deck, const SymbolValues& symbols) {
  return read_deck(FolderSource(".", /*unrestricted=*/true), deck, {.symbols = symbols});
}

void print_diagnostics(const std::vector<Diagnostic>& diagnostics, std::FILE* out) {
  for (const Diagnostic& d : diagnostics) {
    const std::string text = d.text();
    std::fwrite(text.data(), 1, text.size(), out);
    if (text.empty() || text.back() != '\n') std::fputc('\n', out);
  }
}

ExitCode exit_code_of(const LoadReport& report) {
  if (report.ok()) return kDone;
  const bool limit =
      std::any_of(report.diagnostics.begin(), report.diagnostics.end(), [](const Diagnostic& d) {
        return d.severity == Severity::error && d.code.compare(0, 6, "limit-") == 0;
      });
  return limit ? kRefused : kDeckRefused;
}

ExitCode exit_code_of(const Error& error) {
  switch (error.kind) {
    case ErrorKind::deck:
      return kDeckRefused;
    case ErrorKind::not_converged:
    case ErrorKind::singular:
    case ErrorKind::evaluation:
    case ErrorKind::peer:
    case ErrorKind::internal:
      return kNumericalFailure;
    case ErrorKind::cancelled:
      return kInterrupted;
    case ErrorKind::argument:
    case ErrorKind::precondition:
    case ErrorKind::limit:
    case ErrorKind::io:
    case ErrorKind::data_loss:
      return kRefused;
  }
  return kNumericalFailure;
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
