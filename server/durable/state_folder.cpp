#include "durable/state_folder.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <random>

#include "files/folder_size.h"

namespace mbcosim::server {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kPiece = 1 << 20;  // of a file of the model in one record
const std::string kUnfinished = "/unfinished";
const std::string kDamaged = ".damaged", kGone = ".gone";
const std::string kRemovals = "removals";

int take_lock(const std::string& path) {
  const std::string name = path + "/lock";
  const int file = ::open(name.c_str(), O_RDWR | O_CREAT | kOpenOwn, 0600);
  if (file < 0)
    throw std::runtime_error("the state folder " + path +
                             " cannot be used: " + std::strerror(errno));
  if (::flock(file, LOCK_EX | LOCK_NB) == 0) return file;
  ::close(file);
  throw std::runtime_error("another daemon uses the state folder " + path);
}

void make_folder(const std::string& path) {
  if (::mkdir(path.c_str(), 0700) != 0 && errno != EEXIST)
    throw StorageError(std::string("a folder cannot be made: ") + std::strerror(errno));
}

std::vector<fs::path> entries_of(const fs::path& folder) {
  std::error_code error;
  std::vector<fs::path> entries;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error))
    entries.push_back(entry->path());
  return entries;
}

/// What a daemon that was killed had begun to remove, or to write.
void remove_leftovers(const std::string& path) {
  std::error_code none;
  for (const fs::path& folder : entries_of(path)) {
    if (folder.extension() == kGone) fs::remove_all(folder, none);
    if (!folder.extension().empty()) continue;
    for (const fs::path& file : entries_of(folder))
      if (file.extension() == kUnnamed) fs::remove(file, none);
  }
}

}  // namespace

// ------------------------------------------------------------------ the folder

StateFolder::StateFolder(const std::string& path, std::int64_t most) : path_(path), most_(most) {
  std::error_code error;
  if (!fs::is_directory(path_, error))
    throw std::runtime_error("the state folder " + path_ + " is no folder that can be read");
  lock_ = take_lock(path_);
  const bool made = fs::create_directory(path_ + "/simulations", error);
  if (error)
    throw std::runtime_error("the state folder " + path_ +
                             " cannot be written: " + error.message());
  if (made) named("the state folder " + path_, [&] { sync_path(path_); });
  remove_leftovers(path_ + "/simulations");
  used_ = bytes_in(path_ + "/simulations");
}

StateFolder::~StateFolder() { ::close(lock_); }

std::int64_t StateFolder::used() const {
  Guard guard(mutex_);
  return used_;
}

void StateFolder::take(std::int64_t bytes) {
  Guard guard(mutex_);
  if (bytes > most_ - used_)
    throw StorageError("the state folder may take " + std::to_string(most_) +
                       " bytes (limit state_bytes)");
  used_ += bytes;
}

void StateFolder::give_back(std::int64_t bytes) {
  Guard guard(mutex_);
  used_ -= bytes;
}

std::string StateFolder::name() try {
  const std::string path = path_ + "/name";
  if (fs::exists(path)) {
    std::string name;
    read_pieces(path, [&](std::string_view piece) { name += piece; });
    name = name.substr(0, name.find('\n'));
    if (!name.empty()) return name;
  }
  char made[16];
  std::snprintf(made, sizeof made, "%08x", std::random_device()());
  AtomicFile file(path);
  file.write(made);
  file.commit();
  return made;
} catch (const StorageError& error) {
  throw std::runtime_error("the state folder " + path_ + " cannot be used: " + error.what());
}

std::vector<std::string> StateFolder::list() const {
  std::vector<std::string> ids;
  std::error_code error;
  for (fs::directory_iterator entry(path_ + "/simulations", error), end; !error && entry != end;
       entry.increment(error)) {
    const std::string name = entry->path().filename();
    if (name.find('.') == std::string::npos) ids.push_back(name);
  }
  if (error)
    throw std::runtime_error("the state folder " + path_ + " cannot be read: " + error.message());
  std::sort(ids.begin(), ids.end());
  return ids;
}

// ------------------------------------------------------------------ deletions

namespace {

constexpr std::size_t kTextLength = 4;  // bytes of a text's length within a record

std::string bytes_of(const StoredRemoval& removal) {
  std::string content;
  for (const std::string* text : {&removal.identity, &removal.request_id, &removal.simulation})
    content += number_bytes(text->size(), kTextLength) + *text;
  return content;
}

StoredRemoval removal_in(std::string_view content) {
  StoredRemoval removal;
  for (std::string* text : {&removal.identity, &removal.request_id, &removal.simulation}) {
    if (content.size() < kTextLength) throw DamagedFile("a record is too short");
    const std::uint64_t size = number_at(content, 0, kTextLength);
    content.remove_prefix(kTextLength);
    if (size > content.size()) throw DamagedFile("a record is too short");
    *text = content.substr(0, size);
    content.remove_prefix(size);
  }
  return removal;
}

/// Gives the ending to the name of a file or folder. Throws StorageError.
std::string renamed(const std::string& path, const std::string& ending) {
  std::string name = path + ending;
  if (::rename(path.c_str(), name.c_str()) != 0) fail_storage("it cannot be put aside");
  return name;
}

}  // namespace

void StateFolder::write_removals(const std::deque<StoredRemoval>& removals) {
  AtomicFile file(path_ + "/" + kRemovals);
  RecordWriter records([&](std::string_view bytes) { file.write(bytes); });
  records.begin(kRemovals);
  for (const StoredRemoval& removal : removals) records.add(RecordKind::removal, bytes_of(removal));
  records.end();
  file.commit();
}

std::deque<StoredRemoval> StateFolder::read_removals() const {
  std::deque<StoredRemoval> removals;
  std::error_code error;
  if (!fs::exists(path_ + "/" + kRemovals, error) && !error) return removals;
  named(kRemovals, [&] {
    read_records(path_, kRemovals, [&](RecordKind kind, const std::string& content) {
      if (kind == RecordKind::removal) removals.push_back(removal_in(content));
    });
  });
  return removals;
}

std::string StateFolder::put_removals_aside() { return renamed(path_ + "/" + kRemovals, kDamaged); }

// ------------------------------------------------------------------ writing

template <class Write>
void StateFolder::write_file(const std::string& id, const std::string& name, Write&& write) {
  const std::string path = folder(id) + "/" + name;
  const std::int64_t before = bytes_of_file(path);
  AtomicFile file(path);
  std::int64_t taken = 0;
  try {
    RecordWriter records([&](std::string_view bytes) {
      take(static_cast<std::int64_t>(bytes.size()));
      taken += static_cast<std::int64_t>(bytes.size());
      file.write(bytes);
    });
    records.begin(name);
    write(records);
    records.end();
    file.commit();
  } catch (const NotSynced&) {
    give_back(before);
    throw;
  } catch (...) {
    give_back(taken);
    throw;
  }
  give_back(before);
}

void StateFolder::start(const std::string& id) {
  const std::string begun = folder(id) + kGone;  // it gets its name with the mark in it
  make_folder(begun);
  AtomicFile mark(begun + kUnfinished);
  mark.commit();
  if (::rename(begun.c_str(), folder(id).c_str()) != 0)
    throw StorageError(std::string("a folder cannot get its name: ") + std::strerror(errno));
  sync_path(path_ + "/simulations");
}

void StateFolder::finish(const std::string& id) {
  const std::string mark = folder(id) + kUnfinished;
  if (::unlink(mark.c_str()) != 0)
    throw StorageError(std::string("a file cannot be removed: ") + std::strerror(errno));
  sync_path(folder(id));
}

bool StateFolder::is_unfinished(const std::string& id) const {
  std::error_code error;
  const bool there = fs::exists(folder(id) + kUnfinished, error);
  if (error) throw StorageError(id + kUnfinished + ": it cannot be looked for: " + error.message());
  return there;
}

void StateFolder::write_model(const std::string& id, const StoredModel& model) {
  make_folder(folder(id));
  sync_path(path_ + "/simulations");
  write_file(id, kModelFile, [&](RecordWriter& records) {
    records.add(RecordKind::head, model.head.SerializeAsString());
    v1::FileChunk chunk;
    for (const auto& [name, bytes] : model.files) {
      chunk.set_path(name);
      for (std::size_t at = 0; at == 0 || at < bytes.size(); at += kPiece) {
        chunk.set_data(bytes.substr(at, kPiece));
        records.add(RecordKind::file, chunk.SerializeAsString());
      }
    }
  });
}

void StateFolder::write_point(const std::string& id, const StoredPoint& point) {
  write_file(id, kPointFile, [&](RecordWriter& records) { add_records(point, records); });
}

void StateFolder::write_snapshot(const std::string& id, int number, const std::string& state) {
  write_file(id, kSnapshotFile + std::to_string(number),
             [&](RecordWriter& records) { records.add(RecordKind::state, state); });
}

void StateFolder::remove_snapshot(const std::string& id, int number) {
  const std::string path = folder(id) + "/" + kSnapshotFile + std::to_string(number);
  const std::int64_t size = bytes_of_file(path);
  if (::unlink(path.c_str()) == 0) give_back(size);
}

bool StateFolder::remove(const std::string& id) {
  const std::int64_t size = bytes_in(folder(id));
  const std::string gone = folder(id) + kGone;
  std::error_code failed, none;
  fs::rename(folder(id), gone, failed);  // at once, should the daemon be killed now
  if (failed) fs::remove_all(folder(id), none);
  try {
    sync_path(path_ + "/simulations");
  } catch (const StorageError&) {  // it may be there again after a power failure
  }
  fs::remove_all(gone, none);
  give_back(size - bytes_in(folder(id)) - bytes_in(gone));
  return !fs::exists(folder(id), none);
}

std::string StateFolder::put_aside(const std::string& id) { return renamed(folder(id), kDamaged); }

// ------------------------------------------------------------------ reading

v1::CheckpointHead StateFolder::read_head(const std::string& id) const {
  return read_model(id).head;
}

StoredModel StateFolder::read_model(const std::string& id) const {
  return named(id + "/" + kModelFile, [&] { return server::read_model(folder(id)); });
}

StoredPoint StateFolder::read_point(const std::string& id) const {
  return named(id + "/" + kPointFile, [&] { return server::read_point(folder(id)); });
}

std::string StateFolder::read_snapshot(const std::string& id, int number) const {
  return named(id + "/" + kSnapshotFile + std::to_string(number),
               [&] { return server::read_snapshot(folder(id), number); });
}

std::vector<std::string> StateFolder::files_of(const std::string& id) const {
  std::vector<std::string> paths = {folder(id) + "/" + kModelFile, folder(id) + "/" + kPointFile};
  for (const int number : snapshots(id))
    paths.push_back(folder(id) + "/" + kSnapshotFile + std::to_string(number));
  return paths;
}

std::vector<int> StateFolder::numbered(const std::string& id, const std::string& prefix) const {
  return named(id, [&] { return numbers_of(folder(id), prefix); });
}

std::vector<int> StateFolder::snapshots(const std::string& id) const {
  return numbered(id, kSnapshotFile);
}

std::int64_t StateFolder::used_at(const std::string& id) const {
  std::int64_t last = 0;
  const auto look = [&](const std::string& path) {
    struct stat info {};
    if (::stat(path.c_str(), &info) == 0) last = std::max<std::int64_t>(last, info.st_mtime);
  };
  look(folder(id) + "/" + kPointFile);
  for (const int number : journals(id)) look(journal_path(id, number));
  return last;
}

// The time of its point tells; one that cannot be set leaves that of its last checkpoint.
void StateFolder::note_use(const std::string& id) const {
  (void)::utimensat(AT_FDCWD, (folder(id) + "/" + kPointFile).c_str(), nullptr, 0);
}

// ------------------------------------------------------------------ journals

std::vector<int> StateFolder::journals(const std::string& id) const {
  return numbered(id, kJournalFile);
}

void StateFolder::read_journals(const std::string& id, const EntryHandler& handler) const {
  for (const int number : journals(id)) {
    const std::string name = kJournalFile + std::to_string(number);
    const std::string path = journal_path(id, number);
    named(id + "/" + name, [&] {
      std::string bytes;
      read_pieces(path, [&](std::string_view piece) { bytes += piece; });
      read_journal(bytes, name, handler);
    });
  }
}

void StateFolder::remove_journals(const std::string& id, int end) {
  for (const int number : journals(id)) {
    if (number >= end) return;
    const std::string path = journal_path(id, number);
    const std::int64_t size = bytes_of_file(path);
    if (::unlink(path.c_str()) == 0) give_back(size);
  }
}

}  // namespace mbcosim::server
