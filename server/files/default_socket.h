/// Where a daemon of a user listens, and its clients look for it, when no address is given.
#pragma once

#include <string>

namespace mbcosim::server {

/// "unix:$XDG_RUNTIME_DIR/mbcosim.sock", or in a folder of /tmp that is named after the user.
std::string default_socket();

/// In /tmp anybody may have made that folder before: who did would be asked instead of the daemon.
/// Nothing for other addresses, and while the folder is not there. Throws std::runtime_error.
void check_default_socket(const std::string& address);
/// The same for the daemon, which makes the folder in /tmp where it is not there.
void make_default_folder(const std::string& address);

}  // namespace mbcosim::server
