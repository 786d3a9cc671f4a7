#include "cli/commands.h"
#include "cli/deck_report.h"
#include "cli/json.h"

namespace mbcosim::cli {

int validate(const std::string& deck, const SymbolValues& symbols, bool json) {
  const LoadReport report = load_path(deck, symbols);
  if (json) {
    std::printf("%s\n", diagnostics_json(report).c_str());
    return exit_code_of(report);
  }
  print_diagnostics(report.diagnostics, stdout);
  if (has_nothing_to_run(report)) print_nothing_to_run(deck, Severity::warning, stdout);
  if (report.ok()) {
    std::printf("%s: ok, %zu structural nodes, %zu scalar nodes, %zu elements, %d unknowns\n",
                deck.c_str(), report.model->structural.size(), report.model->scalars.size(),
                report.model->elements.size(), report.model->unknowns);
  }
  return exit_code_of(report);
}

}  // namespace mbcosim::cli
