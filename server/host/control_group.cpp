#include "host/control_group.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <thread>

namespace mbcosim::server {
namespace {

namespace fs = std::filesystem;

constexpr double kNone = std::numeric_limits<double>::infinity();

/// The file's number; none when it says "max" or is not there.
double limit_in(const fs::path& path) {
  std::ifstream file(path);
  double number = 0;
  return file >> number && number > 0 ? number : kNone;
}

/// "QUOTA PERIOD", or "max PERIOD".
double share_in(const fs::path& path) {
  std::ifstream file(path);
  double quota = 0, period = 0;
  return file >> quota >> period && quota > 0 && period > 0 ? quota / period : kNone;
}

/// What is limited: by which controller of the older version, and what a group's folder says.
struct Resource {
  const char* controller;
  double (*unified)(const fs::path& folder);
  double (*older)(const fs::path& folder);
};

constexpr Resource kMemory = {
    "memory", [](const fs::path& folder) { return limit_in(folder / "memory.max"); },
    [](const fs::path& folder) { return limit_in(folder / "memory.limit_in_bytes"); }};
constexpr Resource kProcessors = {
    "cpu", [](const fs::path& folder) { return share_in(folder / "cpu.max"); },
    [](const fs::path& folder) {
      const double quota = limit_in(folder / "cpu.cfs_quota_us");  // -1: none
      return quota == kNone ? kNone : quota / limit_in(folder / "cpu.cfs_period_us");
    }};

/// Of a group and all above it. A container may see the path that its host has for it: folders that
/// are not there limit nothing, the root of what is mounted is its own.
double least_above(double (*limit)(const fs::path&), const fs::path& mount, const fs::path& group) {
  double least = kNone;
  for (fs::path at = group.lexically_normal().relative_path();; at = at.parent_path()) {
    least = std::min(least, limit(mount / at));
    if (at.empty()) return least;
  }
}

/// Is "memory" in "cpu,memory"?
bool has(const std::string& controllers, const std::string& controller) {
  return ("," + controllers + ",").find("," + controller + ",") != std::string::npos;
}

double least(const Resource& resource, const std::string& root) {
  const fs::path unified = fs::path(root) / "sys/fs/cgroup", older = unified / resource.controller;
  double least = std::min(least_above(resource.unified, unified, "/"),
                          least_above(resource.older, older, "/"));
  std::ifstream groups(fs::path(root) / "proc/self/cgroup");
  std::string line;
  while (std::getline(groups, line)) {  // "0::/GROUP" is unified, "4:cpu,memory:/GROUP" is older
    const std::size_t first = line.find(':'), second = line.find(':', first + 1);
    if (second == std::string::npos) continue;
    const std::string controllers = line.substr(first + 1, second - first - 1);
    const fs::path group = line.substr(second + 1);
    if (controllers.empty()) least = std::min(least, least_above(resource.unified, unified, group));
    if (has(controllers, resource.controller))
      least = std::min(least, least_above(resource.older, older, group));
  }
  return least;
}

}  // namespace

std::int64_t control_group_memory(const std::string& root) {
  constexpr std::int64_t kMost = std::numeric_limits<std::int64_t>::max();
  const double bytes = least(kMemory, root);
  return bytes < static_cast<double>(kMost) ? static_cast<std::int64_t>(bytes) : kMost;
}

double control_group_processors(const std::string& root) { return least(kProcessors, root); }

int usable_cores() {
  static const int cores = [] {
    const double all = std::max(1u, std::thread::hardware_concurrency());
    return static_cast<int>(std::clamp(std::floor(control_group_processors()), 1.0, all));
  }();
  return cores;
}

}  // namespace mbcosim::server
