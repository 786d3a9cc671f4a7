/// Where the project's sources are, for tests that read decks or tables.
#pragma once

#include <string>

namespace mbcosim {

std::string source_dir();

}  // namespace mbcosim
