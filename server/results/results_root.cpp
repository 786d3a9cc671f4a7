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
  if (path_.empty()) return;
  Guard guard(mutex_);
  measure();
}

std::unique_ptr<ResultsFolder> ResultsRoot::make(const std::string& simulation,
                                                 std::int64_t quota) {
  if (path_.empty())
    throw Refusal(v1::REASON_NO_RESULTS,
                  "the server writes no result files: it was started without --results-root");
  const std::string path = path_of(simulation);
  take(path, quota);
  if (::mkdir(path.c_str(), 0700) == 0) return std::make_unique<ResultsFolder>(*this, path, quota);
  const std::string why = std::strerror(errno);
  give_back(path);
  throw Refusal(v1::REASON_STORAGE_FULL, "the folder for the results cannot be made: " + why);
}

std::unique_ptr<ResultsFolder> ResultsRoot::reopen(const std::string& simulation,
                                                   std::int64_t quota, bool* found) {
  std::error_code none;
  const std::string path = path_of(simulation);
  *found = !path_.empty() && fs::is_directory(path, none);
  if (!*found) return make(simulation, quota);
  take(path, quota);
  return std::make_unique<ResultsFolder>(*this, path, quota);
}

void ResultsRoot::remove(const std::string& simulation) {
  if (path_.empty()) return;
  const std::int64_t bytes = bytes_in(path_of(simulation));
  std::error_code none;
  fs::remove_all(path_of(simulation), none);
  Guard guard(mutex_);
  left_ -= bytes;
}

// What is there and not in use.
void ResultsRoot::measure() {
  left_ = bytes_in(path_);
  for (const auto& [path, quota] : quotas_) left_ -= bytes_in(path);
  measured_ = std::chrono::steady_clock::now();
}

// Operators remove files, too: before there is no room it is looked anew, once in a second.
void ResultsRoot::take(const std::string& path, std::int64_t quota) {
  const std::int64_t there = bytes_in(path);  // of an earlier process
  Guard guard(mutex_);
  const std::int64_t more = quota - there;
  if (!has_room(more) && std::chrono::steady_clock::now() - measured_ > std::chrono::seconds(1))
    measure();
  if (!has_room(more))
    throw limit_refusal("results_root_bytes", most_,
                        "the folder of results has no room for another quota of " +
                            std::to_string(more) + " bytes");
  quotas_[path] = quota;
  promised_ += quota;
  left_ -= there;
}

void ResultsRoot::give_back(const std::string& path) {
  const std::int64_t there = bytes_in(path);
  Guard guard(mutex_);
  const auto quota = quotas_.find(path);
  promised_ -= quota->second;
  quotas_.erase(quota);
  left_ += there;
}

ResultsFolder::~ResultsFolder() {
  std::error_code none;
  if (!kept_) fs::remove_all(path_, none);
  root_.give_back(path_);
}

}  // namespace mbcosim::server
