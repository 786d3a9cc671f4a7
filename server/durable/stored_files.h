/// The files in which one simulation is stored: its model, its last checkpoint, its snapshots, and
/// what its journal tells of later.
#pragma once

#include <deque>
#include <map>
#include <string>
#include <vector>

#include "durable/journal.h"
#include "durable/record_file.h"
#include "mbcosim/v1/checkpoints.pb.h"

namespace mbcosim::server {

inline const std::string kModelFile = "model", kPointFile = "point";
inline const std::string kSnapshotFile = "snapshot-", kJournalFile = "journal-";  ///< a number

/// What a stored simulation is made of.
struct StoredModel {
  v1::CheckpointHead head;
  std::map<std::string, std::string> files;  ///< of the deck
};
struct StoredPoint {
  v1::CheckpointPoint point;
  std::string state;  ///< of Simulation::export_state
};

/// All of a stored simulation, as it is read from a series of files.
struct StoredBundle {
  StoredModel model;
  StoredPoint point;
  std::map<int, std::string> snapshots;  ///< states by number
  /// Of the file of that name. Throws StorageError.
  void add(const std::string& file, RecordKind kind, std::string content);
};

/// Files that are read one after the other, as they were when they were opened.
class OpenFiles {
 public:
  /// Throws StorageError.
  explicit OpenFiles(const std::vector<std::string>& paths);
  /// At most so many bytes; none: that was all. Throws StorageError.
  std::string read(std::size_t most);

 private:
  std::deque<ReadFile> files_;
};

/// All records of a file, which must be the one of that name. Throws StorageError, and so do those
/// below.
void read_records(const std::string& folder, const std::string& name,
                  const RecordReader::Handler& handler);
StoredModel read_model(const std::string& folder);
StoredPoint read_point(const std::string& folder);
std::string read_snapshot(const std::string& folder, int number);
/// N of the files "PREFIXN", in their order; none when there is no such folder.
std::vector<int> numbers_of(const std::string& folder, const std::string& prefix);

/// The records of a file "point".
void add_records(const StoredPoint& point, RecordWriter& records);

/// Throws DamagedFile.
v1::JournalEntry message_of(const StoredEntry& entry);
/// To what an entry tells, its replies apart; false when it is not later than the point.
bool go_on(const v1::JournalEntry& entry, std::string state, StoredPoint* point);

}  // namespace mbcosim::server
