/// Files that the commands on finite element models write.
#pragma once

#include <string>
#include <vector>

#include "elements/modal/fem_data.h"

namespace mbcosim::cli {

/// Throws ReductionError when it cannot be written.
void write_file(const std::string& path, const std::string& text);
/// In the packed form when the name ends with .bin, else as text; `comments` go to the text only.
void write_fem_file(const std::string& path, const FemData& data,
                    const std::vector<std::string>& comments);

}  // namespace mbcosim::cli
