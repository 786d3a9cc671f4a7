#include "results/results_root.h"

#include <sys/stat.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <stdexcept>

#include "files/folder_size.h"
#include "wire/refusal.h"

namespace mbcosim::server {
namespace {

namespace fs = std::filesystem;

std::string usable(const std::string& path) {
  if (path.empty()) return path;
  std::error_code error;
  const fs::path root = fs::canonical(path, error);
  if (error || !fs::is_directory(root, error))
    throw std::runtime_error("the folder of results cannot be used: " + path +
                             " is no folder that can be read");
  return root;
}

}  // namespace

ResultsRoot::ResultsRoot(const std::string& path, std::int64_t most)
    : path_(usable(path)), most_(most) {
  if (!path_.empty()) used_ = bytes_in(path_);
}

std::unique_ptr<ResultsFolder> ResultsRoot::make(const std::string& simulation,
                                                 std::int64_t quota) {
  if (path_.empty())
    throw Refusal(v1::REASON_NO_RESULTS,
                  "the server writes no result files: it was started without --results-root");
  take(quota);
  const std::string path = path_of(simulation);
  if (::mkdir(path.c_str(), 0700) == 0) return std::make_unique<ResultsFolder>(*this, path, quota);
  const std::string why = std::strerror(errno);
  give_back(quota);
  throw Refusal(v1::REASON_STORAGE_FULL, "the folder for the results cannot be made: " + why);
}

std::unique_ptr<ResultsFolder> ResultsRoot::reopen(const std::string& simulation,
                                                   std::int64_t quota, bool* found) {
  std::error_code none;
  *found = !path_.empty() && fs::is_directory(path_of(simulation), none);
  if (!*found) return make(simulation, quota);
  take(quota - bytes_in(path_of(simulation)));
  return std::make_unique<ResultsFolder>(*this, path_of(simulation), quota);
}

void ResultsRoot::remove(const std::string& simulation) {
  if (path_.empty()) return;
  const std::int64_t bytes = bytes_in(path_of(simulation));
  std::error_code none;
  fs::remove_all(path_of(simulation), none);
  give_back(bytes);
}

void ResultsRoot::take(std::int64_t bytes) {
  Guard guard(mutex_);
  if (bytes > most_ - used_)
    throw limit_refusal("results_root_bytes", most_,
                        "the folder of results has no room for another quota of " +
                            std::to_string(bytes) + " bytes");
  used_ += bytes;
}

void ResultsRoot::give_back(std::int64_t bytes) {
  Guard guard(mutex_);
  used_ -= bytes;
}

ResultsFolder::~ResultsFolder() {
  std::error_code none;
  if (!kept_) fs::remove_all(path_, none);
  root_.give_back(budget_.most() - (kept_ ? bytes_in(path_) : 0));
}

}  // namespace mbcosim::server
