#include "durable/stored_files.h"

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <optional>
#include <utility>

namespace mbcosim::server {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kLongestRecord = 1LL << 40;

template <class Message>
void parse(const std::string& content, Message* message) {
  if (!message->ParseFromString(content)) throw DamagedFile("a record cannot be understood");
}

std::optional<int> number_of(const std::string& name, const std::string& prefix) {
  if (name.compare(0, prefix.size(), prefix) != 0) return std::nullopt;
  int number = 0;
  const char* end = name.data() + name.size();
  const auto [at, error] = std::from_chars(name.data() + prefix.size(), end, number);
  if (error != std::errc() || at != end || number < 1) return std::nullopt;
  return number;
}

/// Of one file of the folder.
StoredBundle read_file(const std::string& folder, const std::string& name) {
  StoredBundle bundle;
  read_records(folder, name, [&](RecordKind kind, std::string content) {
    bundle.add(name, kind, std::move(content));
  });
  return bundle;
}

}  // namespace

void StoredBundle::add(const std::string& file, RecordKind kind, std::string content) {
  if (kind == RecordKind::begin || kind == RecordKind::end) return;
  const auto number = number_of(file, kSnapshotFile);
  if (number && kind == RecordKind::state) {
    snapshots[*number] = std::move(content);
  } else if (file == kModelFile && kind == RecordKind::head) {
    parse(content, &model.head);
  } else if (file == kModelFile && kind == RecordKind::file) {
    v1::FileChunk chunk;
    parse(content, &chunk);
    model.files[chunk.path()] += chunk.data();
  } else if (file == kPointFile && kind == RecordKind::point) {
    parse(content, &point.point);
  } else if (file == kPointFile && kind == RecordKind::state) {
    point.state = std::move(content);
  } else {
    throw DamagedFile("the file \"" + file.substr(0, 100) + "\" has a record of a wrong kind");
  }
}

OpenFiles::OpenFiles(const std::vector<std::string>& paths) {
  for (const std::string& path : paths) files_.emplace_back(path);
}

std::string OpenFiles::read(std::size_t most) {
  std::string piece(most, '\0');
  for (; !files_.empty(); files_.pop_front()) {
    const std::size_t count = files_.front().read(&piece).size();
    if (count == 0) continue;
    piece.resize(count);
    return piece;
  }
  return {};
}

void read_records(const std::string& folder, const std::string& name,
                  const RecordReader::Handler& handler) {
  RecordReader reader(kLongestRecord, handler);
  read_pieces(folder + "/" + name, [&](std::string_view piece) { reader.take(piece); });
  reader.finish();
  if (reader.file() != name) throw DamagedFile("it is the file \"" + reader.file() + "\"");
}

StoredModel read_model(const std::string& folder) { return read_file(folder, kModelFile).model; }

StoredPoint read_point(const std::string& folder) { return read_file(folder, kPointFile).point; }

std::string read_snapshot(const std::string& folder, int number) {
  return read_file(folder, kSnapshotFile + std::to_string(number)).snapshots[number];
}

std::vector<int> numbers_of(const std::string& folder, const std::string& prefix) {
  std::vector<int> numbers;
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error))
    if (const auto number = number_of(entry->path().filename(), prefix)) numbers.push_back(*number);
  if (error && error != std::errc::no_such_file_or_directory)
    throw StorageError("the files cannot be listed: " + error.message());
  std::sort(numbers.begin(), numbers.end());
  return numbers;
}

void add_records(const StoredPoint& point, RecordWriter& records) {
  records.add(RecordKind::point, point.point.SerializeAsString());
  records.add(RecordKind::state, point.state);
}

v1::JournalEntry message_of(const StoredEntry& entry) {
  v1::JournalEntry message;
  if (!message.ParseFromString(entry.message)) throw DamagedFile("an entry cannot be understood");
  return message;
}

bool go_on(const v1::JournalEntry& entry, std::string state, StoredPoint* point) {
  if (entry.changes() <= point->point.changes()) return false;
  point->point.set_changes(entry.changes());
  point->point.set_finished(entry.finished());
  *point->point.mutable_info() = entry.info();
  *point->point.mutable_ports() = entry.ports();
  point->point.clear_results_until_step();
  point->state = std::move(state);
  return true;
}

}  // namespace mbcosim::server
