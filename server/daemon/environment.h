/// Options that come from environment variables.
#pragma once

#include <string>
#include <vector>

namespace mbcosim::server {

/// "model-root" → "MBCOSIMD_MODEL_ROOT".
std::string variable_of(const std::string& option);

/// What to say about each variable `MBCOSIMD_…` of the environment (as `environ`) that is none of
/// `options`: an option that is misspelled would be an option that is not in force. Those that
/// Kubernetes sets for a service of this name are none of ours.
std::vector<std::string> stray_variables(const std::vector<std::string>& options,
                                         const char* const* environment);

}  // namespace mbcosim::server
