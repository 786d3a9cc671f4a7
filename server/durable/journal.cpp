#include "durable/journal.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

#include "durable/record_file.h"
#include "durable/state_folder.h"

namespace mbcosim::server {
namespace {

constexpr std::size_t kNumber = 8;  // bytes of a length within an entry

/// Length of what follows, again after the record's own: a damaged length cannot pass for a record
/// that was not written to its end.
std::string packed(std::string_view message, std::string_view state) {
  std::string content = number_bytes(kNumber + message.size() + state.size(), kNumber);
  content += number_bytes(message.size(), kNumber);
  content += message;
  content += state;
  return content;
}

StoredEntry unpacked(std::string_view content) {
  if (content.size() < 2 * kNumber) throw DamagedFile("an entry is too short");
  const std::uint64_t size = number_at(content, kNumber, kNumber);
  if (size > content.size() - 2 * kNumber) throw DamagedFile("an entry cannot be understood");
  return {std::string(content.substr(2 * kNumber, size)),
          std::string(content.substr(2 * kNumber + size))};
}

}  // namespace

Journal::Journal(StateFolder& folder, std::string id) : folder_(folder), id_(std::move(id)) {
  const std::vector<int> there = folder_.journals(id_);
  if (!there.empty()) next_ = there.back() + 1;
}

Journal::~Journal() {
  if (file_ >= 0) ::close(file_);
}

void Journal::rotate() {
  if (file_ >= 0) ::close(file_);
  file_ = -1;
  torn_ = false;
  bytes_ = 0;
}

void Journal::open() {
  const std::string path = folder_.journal_path(id_, next_);
  file_ = ::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_APPEND | kOpenOwn, 0600);
  if (file_ < 0) fail_storage("the journal cannot be opened");
  ++next_;
  good_ = 0;
  torn_ = true;  // until its first record is there
  named_ = false;
}

void Journal::mend() {
  if (!torn_) return;
  if (::ftruncate(file_, good_) != 0) fail_storage("the journal cannot be cut back");
  if (good_ == 0) {
    std::string first;
    RecordWriter([&](std::string_view bytes) {
      first += bytes;
    }).begin(kJournalFile + std::to_string(next_ - 1));
    write(first);
  }
  torn_ = false;
}

void Journal::append(std::string_view message, std::string_view state) {
  if (file_ < 0) open();
  mend();
  if (!named_) folder_.sync(id_);
  named_ = true;
  std::string record;
  record.reserve(message.size() + state.size() + 64);
  RecordWriter([&](std::string_view bytes) {
    record += bytes;
  }).add(RecordKind::entry, packed(message, state));
  write(record);
}

// The space is counted first; what cannot be written leaves nothing.
void Journal::write(std::string_view bytes) {
  const auto size = static_cast<std::int64_t>(bytes.size());
  folder_.take(size);
  try {
    torn_ = true;
    for (std::string_view rest = bytes; !rest.empty();) {
      const ssize_t count = ::write(file_, rest.data(), rest.size());
      if (count < 0 && errno == EINTR) continue;
      if (count < 0) fail_storage("the journal cannot be written");
      rest.remove_prefix(static_cast<std::size_t>(count));
    }
    if (::fdatasync(file_) != 0) fail_storage("the journal does not get to the disk");
    torn_ = false;
  } catch (const StorageError&) {
    folder_.give_back(size);
    if (::ftruncate(file_, good_) == 0 && good_ > 0) torn_ = ::fdatasync(file_) != 0;
    throw;
  }
  good_ += size;
  bytes_ += size;
}

// ------------------------------------------------------------------ reading

namespace {

[[noreturn]] void damaged(std::int64_t number, std::size_t at, const std::string& what) {
  throw DamagedFile("record " + std::to_string(number) + " at byte " + std::to_string(at) + ": " +
                    what);
}

/// Is what follows the last whole record only the start of one?
void check_tail(std::string_view rest, std::int64_t number, std::size_t at) {
  if (claims_to_end_within(rest)) damaged(number, at, "its checksum differs");
  if (rest.size() >= kRecordHeader + kNumber &&
      number_at(rest, 4, 8) != number_at(rest, kRecordHeader, kNumber) + kNumber)
    damaged(number, at, "its length makes no sense");
  for (std::size_t later = 1; later < rest.size(); ++later)
    if (record_at(rest.substr(later)))
      damaged(number, at, "it is damaged, and whole records follow it");
}

}  // namespace

void read_journal(std::string_view bytes, const std::string& file, const EntryHandler& handler) {
  std::size_t at = 0;
  std::int64_t number = 1;
  while (const auto record = record_at(bytes.substr(at))) {
    if ((record->kind == RecordKind::begin) != (at == 0) ||
        (at > 0 && record->kind != RecordKind::entry))
      damaged(number, at, "it is out of turn");
    if (at == 0 && record->content != begin_of(file))
      damaged(number, at, "the file is of another kind or version, or another file");
    if (at > 0) handler(unpacked(record->content));
    at += record->size;
    ++number;
  }
  if (at < bytes.size()) check_tail(bytes.substr(at), number, at);
}

}  // namespace mbcosim::server
