/// Files of Unix sockets, which stay behind when a process is killed.
#pragma once

#include <string>

namespace mbcosim::server {

/// Removes the file at `path` when it is a socket on which nobody listens. Nobody who does is
/// disturbed: the question is put by a socket of another type than `type` (SOCK_STREAM, say), which
/// is refused in another way (unix(7), connect(2): EPROTOTYPE). Throws std::runtime_error when
/// somebody listens there, or the file is no socket.
void remove_stale_socket(const std::string& path, int type);

}  // namespace mbcosim::server
