#include "cli/commands.h"
#include "cli/deck_report.h"
#include "cli/json.h"

namespace mbcosim::cli {
namespace {

void print_model(const Model& model) {
  if (!model.title.empty()) std::printf("%s\n", model.title.c_str());
  const InitialValueSettings& iv = model.initial_value;
  std::printf("time %.17g s to %.17g s, step %.17g s, %d unknowns\n", iv.initial_time,
              iv.final_time, iv.time_step, model.unknowns);
  std::printf("\nnodes (%zu)\n", model.structural.size() + model.scalars.size());
  for (const StructuralNode& n : model.structural)
    std::printf("  structural %d  %s  %s\n", n.label, kind_name(n.kind), n.name.c_str());
  for (const ScalarNode& n : model.scalars)
    std::printf("  %s %d  %s\n", kind_name(n.kind), n.label, n.name.c_str());
  std::printf("\nelements (%zu)\n", model.elements.size());
  for (const ElementRef& e : model.elements) {
    const ElementInfo& info = e.set->info(e.index);
    std::printf("  %s %d  %s  %s\n", family_name(info.family), info.label, info.type.c_str(),
                info.name.c_str());
  }
}

void print_variables(const Simulation& simulation) {
  std::printf("\nvariables (%zu): name, size, unit, frame, causality\n",
              simulation.variables().size());
  for (const Variable& v : simulation.variables()) {
    std::printf("  %-36s %3d  %-8s %-8s %s\n", v.name.c_str(), v.size,
                v.unit.empty() ? "-" : v.unit.c_str(), v.frame.empty() ? "-" : v.frame.c_str(),
                causality_name(v.causality));
  }
}

}  // namespace

int describe(const std::string& deck, bool json) {
  const LoadReport report = load_path(deck);
  if (!report.ok()) {
    print_diagnostics(report.diagnostics, stderr);
    return exit_code_of(report);
  }
  auto simulation = Simulation::create(report.model);
  const Simulation* readable = simulation ? simulation->get() : nullptr;
  if (json) {
    std::printf("%s\n", description_json(*report.model, readable).c_str());
  } else {
    print_model(*report.model);
    if (readable) print_variables(*readable);
  }
  if (!simulation) {
    print_error(simulation.error(), stderr);
    return exit_code_of(simulation.error());
  }
  return kDone;
}

}  // namespace mbcosim::cli
