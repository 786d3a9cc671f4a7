#include "source_dir.h"

namespace mbcosim {

std::string source_dir() { return MBCOSIM_SOURCE_DIR; }

}  // namespace mbcosim
