#include "simulation/describe.h"

#include "cli/commands.h"
#include "cli/deck_report.h"

namespace mbcosim::cli {

int describe(const std::string& deck, const SymbolValues& symbols, bool json) {
  const DeckReport report = load_path(deck, symbols);
  if (!report.ok()) {
    print_diagnostics(report.diagnostics, stderr);
    return exit_code_of(report);
  }
  auto simulation = Simulation::create(report.model);
  const ModelDescription description = mbcosim::describe(
      *report.model, simulation ? (*simulation)->variables() : std::vector<Variable>(),
      report.symbols);
  std::printf("%s", (json ? to_json(description) + "\n" : to_text(description)).c_str());
  if (!simulation) {
    print_error(simulation.error(), stderr);
    return exit_code_of(simulation.error());
  }
  return kDone;
}

}  // namespace mbcosim::cli
