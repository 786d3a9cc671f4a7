/// Which build of the program this is.
#pragma once

#include <string>

namespace mbcosim::server {

/// Compiler and build id of the program that runs, "GCC 12.2.0, 9788eb57..." for one; without the
/// id where the linker has written none.
const std::string& this_build();

}  // namespace mbcosim::server
