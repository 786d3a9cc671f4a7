#include "durable/salvage.h"

#include <utility>

#include "durable/stored_files.h"

namespace mbcosim::server {
namespace {

void copy_file(const std::string& folder, const std::string& name, std::string* out) {
  read_pieces(folder + "/" + name, [&](std::string_view piece) { *out += piece; });
}

void write_file(const StoredPoint& point, std::string* out) {
  RecordWriter records([&](std::string_view bytes) { *out += bytes; });
  records.begin(kPointFile);
  add_records(point, records);
  records.end();
}

/// Later files are of no use once an entry is missing.
void follow_journals(const std::string& folder, StoredPoint* point,
                     std::vector<std::string>* left_out) {
  bool whole = true;
  for (const int number : numbers_of(folder, kJournalFile)) {
    const std::string name = kJournalFile + std::to_string(number);
    if (!whole) {
      left_out->push_back(name + ": it follows what is damaged");
      continue;
    }
    try {
      std::string bytes;
      copy_file(folder, name, &bytes);
      read_journal(bytes, name, [&](StoredEntry entry) {
        const v1::JournalEntry message = message_of(entry);
        go_on(message, std::move(entry.state), point);
      });
    } catch (const DamagedFile& damage) {
      left_out->push_back(name + ": " + damage.what());
      whole = false;
    }
  }
}

/// Those that are not whole are taken out of the list.
std::string read_snapshots(const std::string& folder, v1::CheckpointPoint* point,
                           std::vector<std::string>* left_out) {
  std::string bytes;
  google::protobuf::RepeatedPtrField<v1::CheckpointSnapshot> kept;
  for (const v1::CheckpointSnapshot& snapshot : point->snapshots()) {
    const std::string name = kSnapshotFile + std::to_string(snapshot.number());
    try {
      (void)read_snapshot(folder, snapshot.number());
      copy_file(folder, name, &bytes);
      *kept.Add() = snapshot;
    } catch (const DamagedFile& damage) {
      left_out->push_back(name + ": " + damage.what());
    }
  }
  point->mutable_snapshots()->Swap(&kept);
  return bytes;
}

}  // namespace

Salvage salvage(const std::string& folder) {
  Salvage result;
  named(kModelFile, [&] { (void)read_model(folder); });
  copy_file(folder, kModelFile, &result.bytes);
  StoredPoint point = named(kPointFile, [&] { return read_point(folder); });
  follow_journals(folder, &point, &result.left_out);
  const std::string snapshots = read_snapshots(folder, &point.point, &result.left_out);
  write_file(point, &result.bytes);
  result.bytes += snapshots;
  result.info = point.point.info();
  return result;
}

}  // namespace mbcosim::server
