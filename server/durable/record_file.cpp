#include "durable/record_file.h"

#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

#include <cerrno>
#include <cstring>
#include <utility>

namespace mbcosim::server {
namespace {

constexpr std::string_view kMagic = "mbcosim 1 ";

std::uint32_t checksum(std::string_view first, std::string_view second) {
  const auto add = [](uLong crc, std::string_view bytes) {
    return crc32_z(crc, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size());
  };
  return static_cast<std::uint32_t>(add(add(0, first), second));
}

std::string folder_of(const std::string& path) { return path.substr(0, path.rfind('/')); }

}  // namespace

void fail_storage(const std::string& what) {
  throw StorageError(what + ": " + std::strerror(errno));
}

std::string number_bytes(std::uint64_t value, std::size_t count) {
  std::string bytes;
  for (std::size_t k = 0; k < count; ++k) bytes += static_cast<char>(value >> (8 * k));
  return bytes;
}

std::uint64_t number_at(std::string_view bytes, std::size_t at, std::size_t count) {
  std::uint64_t value = 0;
  for (std::size_t k = count; k-- > 0;)
    value = value << 8 | static_cast<unsigned char>(bytes[at + k]);
  return value;
}

std::string begin_of(const std::string& file) { return std::string(kMagic) + file; }

bool claims_to_end_within(std::string_view bytes) {
  return bytes.size() >= kRecordHeader && number_at(bytes, 4, 8) <= bytes.size() - kRecordHeader;
}

std::optional<RecordView> record_at(std::string_view bytes) {
  if (!claims_to_end_within(bytes)) return std::nullopt;
  const auto kind = number_at(bytes, 0, 4);
  if (kind < 1 || kind > static_cast<std::uint64_t>(RecordKind::removal)) return std::nullopt;
  const std::string_view content =
      bytes.substr(kRecordHeader, static_cast<std::size_t>(number_at(bytes, 4, 8)));
  if (number_at(bytes, 12, 4) != checksum(bytes.substr(0, 12), content)) return std::nullopt;
  return RecordView{static_cast<RecordKind>(kind), content, kRecordHeader + content.size()};
}

// ------------------------------------------------------------------ writing

void RecordWriter::begin(const std::string& file) { add(RecordKind::begin, begin_of(file)); }

void RecordWriter::add(RecordKind kind, std::string_view content) {
  std::string header = number_bytes(static_cast<std::uint32_t>(kind), 4);
  header += number_bytes(content.size(), 8);
  header += number_bytes(checksum(header, content), 4);
  sink_(header);
  sink_(content);
}

// ------------------------------------------------------------------ reading

void RecordReader::damaged(const std::string& what) const {
  throw DamagedFile("record " + std::to_string(number_ + 1) + " at byte " + std::to_string(at_) +
                    ": " + what);
}

void RecordReader::take(std::string_view bytes) {
  bytes_ += bytes;
  while (next()) {
  }
  bytes_.erase(0, std::exchange(taken_, 0));
}

bool RecordReader::next() {
  const std::string_view all = std::string_view(bytes_).substr(taken_);
  if (all.size() < kRecordHeader) return false;
  const std::uint64_t length = number_at(all, 4, 8);
  if (length > static_cast<std::uint64_t>(most_)) damaged("its length makes no sense");
  const std::size_t whole = kRecordHeader + static_cast<std::size_t>(length);
  if (all.size() < whole) return false;
  if (number_at(all, 12, 4) != checksum(all.substr(0, 12), all.substr(kRecordHeader, length)))
    damaged("its checksum differs");
  const auto kind = static_cast<RecordKind>(number_at(all, 0, 4));
  std::string content(all.substr(kRecordHeader, length));
  check_order(kind, content);
  taken_ += whole;
  handler_(kind, std::move(content));
  at_ += static_cast<std::int64_t>(whole);
  ++number_;
  return true;
}

void RecordReader::check_order(RecordKind kind, const std::string& content) {
  if (open_ == (kind == RecordKind::begin)) damaged("it is out of turn");
  open_ = kind != RecordKind::end;
  if (kind != RecordKind::begin) return;
  if (content.compare(0, kMagic.size(), kMagic) != 0)
    damaged("the file is of another kind or version");
  file_ = content.substr(kMagic.size());
}

void RecordReader::finish() const {
  if (!bytes_.empty()) damaged("the file ends within it");
  if (open_ || number_ == 0) damaged("the file ends before it");
}

// ------------------------------------------------------------------ files

ReadFile::ReadFile(const std::string& path) : file_(::open(path.c_str(), O_RDONLY | kOpenOwn)) {
  if (file_ < 0 && (errno == ENOENT || errno == ENOTDIR))
    throw DamagedFile(std::string("it cannot be opened: ") + std::strerror(errno));
  if (file_ < 0) fail_storage("it cannot be opened");
  struct stat info {};
  const bool known = ::fstat(file_, &info) == 0;
  if (known && S_ISREG(info.st_mode)) return;
  const int error = errno;
  ::close(file_);
  errno = error;
  if (!known) fail_storage("it cannot be looked at");
  throw DamagedFile("it is no regular file");
}

ReadFile::~ReadFile() { ::close(file_); }

std::string_view ReadFile::read(std::string* bytes) const {
  while (true) {
    const ssize_t count = ::read(file_, bytes->data(), bytes->size());
    if (count >= 0) return std::string_view(*bytes).substr(0, static_cast<std::size_t>(count));
    if (errno != EINTR) fail_storage("it cannot be read");
  }
}

void read_pieces(const std::string& path, const ByteSink& sink) {
  const ReadFile file(path);
  std::string bytes(1 << 20, '\0');
  for (std::string_view piece = file.read(&bytes); !piece.empty(); piece = file.read(&bytes))
    sink(piece);
}

AtomicFile::AtomicFile(std::string path) : path_(std::move(path)) {
  file_ = ::open((path_ + kUnnamed).c_str(), O_WRONLY | O_CREAT | O_TRUNC | kOpenOwn, 0600);
  if (file_ < 0) fail_storage("a file cannot be made");
}

AtomicFile::~AtomicFile() {
  if (file_ < 0) return;
  ::close(file_);
  ::unlink((path_ + kUnnamed).c_str());
}

void AtomicFile::write(std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t count = ::write(file_, bytes.data(), bytes.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) fail_storage("a file cannot be written");
    bytes.remove_prefix(static_cast<std::size_t>(count));
    size_ += count;
  }
}

void AtomicFile::commit() {
  if (::fsync(file_) != 0) fail_storage("a file cannot be written");
  if (::rename((path_ + kUnnamed).c_str(), path_.c_str()) != 0)
    fail_storage("a file cannot get its name");
  ::close(file_);
  file_ = -1;
  try {
    sync_path(folder_of(path_));
  } catch (const StorageError& error) {
    throw NotSynced(error.what());
  }
}

void sync_path(const std::string& path) {
  const int file = ::open(path.c_str(), O_RDONLY | kOpenOwn);
  if (file < 0) fail_storage("what was written cannot be opened");
  const bool done = ::fsync(file) == 0;
  const int error = errno;
  ::close(file);
  errno = error;
  if (!done) fail_storage("what was written does not get to the disk");
}

}  // namespace mbcosim::server
