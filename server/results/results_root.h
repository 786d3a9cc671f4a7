/// The folder on the server's disk in which simulations have folders for their result files.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <string>

#include "output/result_budget.h"
#include "threads/mutex.h"

namespace mbcosim::server {

class ResultsFolder;

/// Thread-safe. What is in the folder and what simulations may still write there is bounded.
class ResultsRoot {
 public:
  /// `path` empty: there is none. `most`: bytes of all that is in it. Throws std::runtime_error
  /// when it cannot be used.
  ResultsRoot(const std::string& path, std::int64_t most);

  /// A new folder for "simulations/ID". Throws NO_RESULTS, LIMIT_EXCEEDED, STORAGE_FULL.
  std::unique_ptr<ResultsFolder> make(const std::string& simulation, std::int64_t quota);
  /// The folder that a simulation had in an earlier process; a new one when it is not there any
  /// more: `*found`.
  std::unique_ptr<ResultsFolder> reopen(const std::string& simulation, std::int64_t quota,
                                        bool* found);
  /// Of a simulation that has no ResultsFolder at the moment. Nothing when it is not there.
  void remove(const std::string& simulation);

 private:
  friend class ResultsFolder;
  std::string path_of(const std::string& simulation) const {
    return path_ + "/" + simulation.substr(simulation.find('/') + 1);
  }
  void take(const std::string& path, std::int64_t quota) TS_EXCLUDES(mutex_);
  void give_back(const std::string& path) TS_EXCLUDES(mutex_);
  void measure() TS_REQUIRES(mutex_);
  bool has_room(std::int64_t bytes) const TS_REQUIRES(mutex_) {
    return bytes <= most_ - promised_ - left_;
  }

  const std::string path_;
  const std::int64_t most_;
  Mutex mutex_;
  std::map<std::string, std::int64_t> quotas_ TS_GUARDED_BY(mutex_);  ///< of folders in use
  std::int64_t promised_ TS_GUARDED_BY(mutex_) = 0;                   ///< their sum
  std::int64_t left_ TS_GUARDED_BY(mutex_) = 0;                       ///< bytes in all others
  std::chrono::steady_clock::time_point measured_ TS_GUARDED_BY(mutex_){};
};

/// The folder of one simulation. At its end it is removed, unless it is to be kept.
class ResultsFolder {
 public:
  ResultsFolder(ResultsRoot& root, std::string path, std::int64_t quota)
      : root_(root), path_(std::move(path)), budget_(quota) {}
  ~ResultsFolder();
  ResultsFolder(const ResultsFolder&) = delete;
  ResultsFolder& operator=(const ResultsFolder&) = delete;

  const std::string& path() const { return path_; }
  ResultBudget& budget() { return budget_; }
  const ResultBudget& budget() const { return budget_; }
  void keep(bool keeps) { kept_ = keeps; }

 private:
  ResultsRoot& root_;
  const std::string path_;
  ResultBudget budget_;
  bool kept_ = false;
};

}  // namespace mbcosim::server
