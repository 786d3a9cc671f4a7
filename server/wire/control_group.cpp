#include "wire/control_group.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <limits>

namespace mbcosim::server {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kNone = std::numeric_limits<std::int64_t>::max();

/// A hierarchy of control groups: where it is mounted, and which file of a folder has the limit.
struct Hierarchy {
  fs::path mount;
  const char* file;
};

/// The file's number; none when it says "max" or is not there.
std::int64_t limit_in(const fs::path& path) {
  std::ifstream file(path);
  std::int64_t number = 0;
  return file >> number && number > 0 ? number : kNone;
}

/// Of a group and all above it. A container may see the path that its host has for it: folders that
/// are not there limit nothing, the root of what is mounted is its own.
std::int64_t least_above(const Hierarchy& hierarchy, const fs::path& group) {
  std::int64_t least = kNone;
  for (fs::path at = group.lexically_normal().relative_path();; at = at.parent_path()) {
    least = std::min(least, limit_in(hierarchy.mount / at / hierarchy.file));
    if (at.empty()) return least;
  }
}

/// Is "memory" in "cpu,memory"?
bool has_memory(const std::string& controllers) {
  return ("," + controllers + ",").find(",memory,") != std::string::npos;
}

}  // namespace

std::int64_t control_group_memory(const std::string& root) {
  const Hierarchy unified{fs::path(root) / "sys/fs/cgroup", "memory.max"};
  const Hierarchy older{fs::path(root) / "sys/fs/cgroup/memory", "memory.limit_in_bytes"};
  std::int64_t least = std::min(least_above(unified, "/"), least_above(older, "/"));
  std::ifstream groups(fs::path(root) / "proc/self/cgroup");
  std::string line;
  while (std::getline(groups, line)) {  // "0::/GROUP" is unified, "4:cpu,memory:/GROUP" is older
    const std::size_t first = line.find(':'), second = line.find(':', first + 1);
    if (second == std::string::npos) continue;
    const std::string controllers = line.substr(first + 1, second - first - 1);
    const fs::path group = line.substr(second + 1);
    if (controllers.empty()) least = std::min(least, least_above(unified, group));
    if (has_memory(controllers)) least = std::min(least, least_above(older, group));
  }
  return least;
}

}  // namespace mbcosim::server
