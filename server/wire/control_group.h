/// What the system allows this process, as systemd or a container's engine has told it.
#pragma once

#include <cstdint>
#include <string>

namespace mbcosim::server {

/// Smallest memory limit of the control groups that this process is in, from its own up to the
/// root, of both versions [bytes]; without any the largest number. `root`: where proc and sys are.
std::int64_t control_group_memory(const std::string& root = "/");

}  // namespace mbcosim::server
