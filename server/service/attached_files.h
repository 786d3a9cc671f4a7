/// Files beside a deck that only viewers read.
#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "input/sources.h"

namespace mbcosim::server {

/// By path, as the deck's own files are named.
using AttachedFiles = std::map<std::string, std::string>;

/// `NAME.view.json` beside the main file, and the files that its texts name, as well as those that
/// a glTF file among them names. Files that are not there are left out: who draws them tells.
/// Throws Refusal when they are larger than `most_bytes` together.
AttachedFiles read_attached(const FileSource& files, const std::string& main_file,
                            std::int64_t most_bytes);

}  // namespace mbcosim::server
