/// Result files of one simulation.
#pragma once

#include <atomic>
#include <memory>
#include <string>
#include <vector>

#include "mbcosim/v1/results.pb.h"
#include "output/result_files.h"
#include "output/result_history.h"
#include "results/results_root.h"

namespace mbcosim::server {

/// The session's lock protects it, except `read` and `discard`. Methods throw Refusal.
class SessionResults {
 public:
  /// Throws BAD_ARGUMENT, and what ResultsRoot::make throws. `most`: the largest quota.
  SessionResults(ResultsRoot& root, const std::string& simulation, const v1::ResultOptions& options,
                 std::int64_t most);
  /// Of a simulation that an earlier process had.
  SessionResults(ResultsRoot& root, const std::string& simulation, const v1::ResultOptions& options,
                 std::int64_t most, bool* found);
  ~SessionResults();

  /// The writer for the simulation; once.
  std::shared_ptr<ResultHistory> start(const Model& model);
  /// All so far is in the files, as far as it can be written.
  void prepare() { (void)writer_->flush(false); }
  /// What is in the files is on the disk. Without the session's lock.
  void sync() const;
  /// From now on the files outlive the simulation, unless they are discarded.
  void keep() { folder_->keep(true); }
  void discard() { discarded_.store(true); }

  /// Is there room for another step, and is everything so far written? What could not be written
  /// before is tried again.
  Status ready();
  /// The error with names of files in place of their paths.
  Error without_paths(Error error) const;

  void list(v1::ListResultsReply* out);
  /// Everything so far is in the files. Throws NO_SUCH_FILE. `*cuts`: for `read`.
  std::int64_t size_of(const std::string& file, std::int64_t* cuts);
  /// Bytes of a file that `size_of` knew. Throws RESULTS_CHANGED when it was cut since then.
  std::string read(const std::string& file, std::int64_t from, std::size_t most,
                   std::int64_t cuts) const;

  // --- where the files stand
  std::int64_t end() const { return writer_->end(); }
  /// The next restore goes to a state that shares its history with the files up to this step.
  void expect(std::int64_t step);
  /// Throws what such a restore would end with, as far as it is known before.
  void check_way_back(std::int64_t step) const;
  /// A restore has been done, or not.
  void restored() { cuts_.fetch_add(1); }

 private:
  std::vector<std::string> names() const;
  void flush();
  std::string path(const std::string& file) const { return folder_->path() + "/" + file; }

  const std::vector<ResultFormat> formats_;  ///< empty: the deck's
  const std::unique_ptr<ResultsFolder> folder_;
  std::shared_ptr<ResultHistory> writer_;
  std::atomic<std::int64_t> cuts_{0};
  std::atomic<bool> discarded_{false};
};

}  // namespace mbcosim::server
