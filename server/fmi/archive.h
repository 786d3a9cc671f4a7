/// Zip archives.
#pragma once

#include <map>
#include <string>

#include "model/diagnostic.h"

namespace mbcosim::fmi {

/// Writes the files (path in the archive -> content) to `path`, whole or not at all: through a
/// temporary file beside it. Equal contents make equal bytes. ErrorKind::io.
mbcosim::Status write_archive(const std::string& path,
                              const std::map<std::string, std::string>& files);

}  // namespace mbcosim::fmi
