/// Machine-readable forms of what `validate` and `describe` print.
#pragma once

#include <string>

#include "simulation/simulation.h"

namespace mbcosim::cli {

/// {"ok": …, "diagnostics": [{severity, code, file, line, column, length, message, …}]}
std::string diagnostics_json(const LoadReport& report);
/// {"title": …, "nodes": […], "elements": […], "variables": […]}; `simulation` may be null.
std::string description_json(const Model& model, const Simulation* simulation);

const char* severity_name(Severity severity);
const char* causality_name(Causality causality);

}  // namespace mbcosim::cli
