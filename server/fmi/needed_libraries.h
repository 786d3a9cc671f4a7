/// Shared libraries that travel with an FMU.
#pragma once

#include <map>
#include <string>

#include "model/diagnostic.h"

namespace mbcosim::fmi {

/// What `library` loads besides the C library and its parts, which every system has: name by which
/// it is asked for -> path of the file. ErrorKind::io. Sanitized builds find none.
Result<std::map<std::string, std::string>> needed_libraries(const std::string& library);

}  // namespace mbcosim::fmi
