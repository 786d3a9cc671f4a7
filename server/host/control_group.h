/// What the system allows this process, as systemd or a container's engine has told it. `root`:
/// where proc and sys are. Source: "Control Group v2" and "CFS Bandwidth Control" of the kernel's
/// documentation.
#pragma once

#include <cstdint>
#include <string>

namespace mbcosim::server {

/// Smallest memory limit of the control groups that this process is in, from its own up to the
/// root, of both versions [bytes]; without any the largest number.
std::int64_t control_group_memory(const std::string& root = "/");

/// The same of processor time, in processors: 1.5 is one and a half second in each; without any
/// infinity.
double control_group_processors(const std::string& root = "/");

/// Cores that the threads of this process may keep busy at once, at least 1: of its affinity, and
/// no more than the whole ones that its control groups allow. Who uses more is stopped for most of
/// each tenth of a second. As they are at the first call.
int usable_cores();

}  // namespace mbcosim::server
