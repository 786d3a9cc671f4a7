/// Files that decide who comes in.
#pragma once

#include <string>

namespace mbcosim::server {

/// Who may write such a file, or put another one in its place, may let anybody in. Throws
/// std::runtime_error, which tells what to change, unless nobody but root and the daemon's own user
/// may: the file is theirs, as are all folders above it and above the link that names it, and
/// others may write neither. A folder with the sticky bit, such as /tmp, is as good: there others
/// cannot rename what is not theirs. `what` is the file's name for people: "the tokens file".
void check_trusted(const std::string& what, const std::string& path);

}  // namespace mbcosim::server
