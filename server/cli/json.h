/// The machine-readable form of what `validate` prints.
#pragma once

#include <string>

#include "simulation/simulation.h"

namespace mbcosim::cli {

/// {"ok": …, "diagnostics": [{severity, code, file, line, column, length, message, …}]}
std::string diagnostics_json(const LoadReport& report);

}  // namespace mbcosim::cli
