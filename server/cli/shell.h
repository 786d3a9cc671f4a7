/// What shells and `man` are told about the command line, read from the command line's own parser.
#pragma once

#include <string>

#include "cli/cli11.h"

namespace mbcosim::cli {

/// A completion script for "bash", "zsh" or "fish".
std::string completion_script(const CLI::App& app, const std::string& shell);

/// The manual page, in roff.
std::string manual_page(const CLI::App& app);

}  // namespace mbcosim::cli
