/// The folder in which simulations outlive the daemon.
#pragma once

#include <cstdint>
#include <deque>
#include <string>
#include <vector>

#include "durable/stored_files.h"
#include "threads/mutex.h"

namespace mbcosim::server {

/// A deletion whose request had an id.
struct StoredRemoval {
  std::string identity, request_id;
  std::string simulation;  ///< its name
};

/// DIR/lock, which one daemon holds; DIR/name; DIR/removals; DIR/simulations/ID with the files
/// "model" (written once), "point" (replaced by each checkpoint), "snapshot-N" and "journal-N", and
/// "unfinished" while it is made; ID.gone before that and while it is removed, ID.damaged when it
/// cannot be read. Thread-safe, as long as each simulation is written by one thread at a time.
class StateFolder {
 public:
  /// `most`: bytes of all that is in it. Throws std::runtime_error when the folder cannot be used
  /// or another daemon uses it.
  StateFolder(const std::string& path, std::int64_t most);
  ~StateFolder();
  StateFolder(const StateFolder&) = delete;
  StateFolder& operator=(const StateFolder&) = delete;

  /// A name for whose folder this is, made with it: 8 of 0 to 9 and a to f. Throws
  /// std::runtime_error when it can neither be read nor written.
  std::string name();
  /// IDs of the simulations that are stored. Throws std::runtime_error when that cannot be told.
  std::vector<std::string> list() const;
  /// Deletions, the oldest first: all of them, in the place of those before. They count nothing, so
  /// that a full folder keeps nobody from deleting. Throws StorageError.
  void write_removals(const std::deque<StoredRemoval>& removals);
  /// Those that were written last. Throws StorageError.
  std::deque<StoredRemoval> read_removals() const;
  /// Keeps the damaged file of deletions where nobody reads it; its new name. Throws StorageError.
  std::string put_removals_aside();

  // --- of one simulation. All throw StorageError, those that read DamagedFile where what is stored
  // is at fault; what is written is on the disk then.
  /// Until `finish` it is no simulation yet, should the daemon be killed.
  void start(const std::string& id);
  void finish(const std::string& id);
  bool is_unfinished(const std::string& id) const;
  void write_model(const std::string& id, const StoredModel& model);
  void write_point(const std::string& id, const StoredPoint& point);
  void write_snapshot(const std::string& id, int number, const std::string& state);
  v1::CheckpointHead read_head(const std::string& id) const;
  StoredModel read_model(const std::string& id) const;
  StoredPoint read_point(const std::string& id) const;
  std::string read_snapshot(const std::string& id, int number) const;
  std::vector<int> snapshots(const std::string& id) const;
  void remove_snapshot(const std::string& id, int number);

  // --- its journal
  std::string journal_path(const std::string& id, int number) const {
    return folder(id) + "/" + kJournalFile + std::to_string(number);
  }
  std::vector<int> journals(const std::string& id) const;
  /// All entries, the oldest first. What was being written when the daemon was killed is left out:
  /// it stays at the end of its file, to which nothing is added any more.
  void read_journals(const std::string& id, const EntryHandler& handler) const;
  /// Those before file `end`.
  void remove_journals(const std::string& id, int end);
  /// The names of its files are on the disk.
  void sync(const std::string& id) const { sync_path(folder(id)); }
  /// Counts bytes that are about to be written, or are gone. Throws StorageError.
  void take(std::int64_t bytes) TS_EXCLUDES(mutex_);
  void give_back(std::int64_t bytes) TS_EXCLUDES(mutex_);

  /// When it was written or used last [s since 1970].
  std::int64_t used_at(const std::string& id) const;
  /// It is in use now.
  void note_use(const std::string& id) const;
  /// Nothing when there is none. False: what the system does not let be removed stays, and the next
  /// start finds it.
  bool remove(const std::string& id);
  /// Keeps what is damaged where nobody takes it for a simulation; its new name. Throws
  /// StorageError when it must stay where it is.
  std::string put_aside(const std::string& id);

  /// All of a simulation as one stream of bytes.
  std::vector<std::string> files_of(const std::string& id) const;
  std::int64_t used() const TS_EXCLUDES(mutex_);

 private:
  std::string folder(const std::string& id) const { return path_ + "/simulations/" + id; }
  template <class Write>
  void write_file(const std::string& id, const std::string& name, Write&& write);
  std::vector<int> numbered(const std::string& id, const std::string& prefix) const;

  const std::string path_;
  const std::int64_t most_;
  int lock_ = -1;
  mutable Mutex mutex_;
  std::int64_t used_ TS_GUARDED_BY(mutex_) = 0;
};

}  // namespace mbcosim::server
