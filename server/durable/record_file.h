/// Files of records that tell when they are torn or damaged.
///
/// A record: kind (4 bytes), length of its content (8 bytes), CRC-32 of kind, length and content
/// (4 bytes), all with the lowest byte first, then the content. A file begins with a record of kind
/// `begin`, whose content is "mbcosim 1 " and the file's name, and ends with one of kind `end`.
#pragma once

#include <fcntl.h>

#include <cstdint>
#include <functional>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

namespace mbcosim::server {

enum class RecordKind : std::uint32_t {
  begin = 1,
  end = 2,
  head = 3,
  file = 4,
  point = 5,
  state = 6,
  entry = 7,
  removal = 8
};

/// What cannot be written, as the system says. The message has no path.
class StorageError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// What is stored is not what was written. Any other StorageError is the system's: what it keeps
/// from us may be whole.
class DamagedFile : public StorageError {
 public:
  using StorageError::StorageError;
};

/// It has its name, but that need not be on the disk.
class NotSynced : public StorageError {
 public:
  using StorageError::StorageError;
};

/// Throws StorageError with `what` and what the system says (errno).
[[noreturn]] void fail_storage(const std::string& what);
/// What `read` returns; its error is thrown on with `name` before it, and is of the same kind.
template <class Read>
auto named(const std::string& name, Read&& read) {
  try {
    return read();
  } catch (const DamagedFile& error) {
    throw DamagedFile(name + ": " + error.what());
  } catch (const StorageError& error) {
    throw StorageError(name + ": " + error.what());
  }
}

constexpr std::size_t kRecordHeader = 16;  ///< bytes before a record's content

/// Whole numbers as records have them: the lowest byte first.
std::string number_bytes(std::uint64_t value, std::size_t count);
std::uint64_t number_at(std::string_view bytes, std::size_t at, std::size_t count);

/// A whole record at the start of some bytes.
struct RecordView {
  RecordKind kind;
  std::string_view content;
  std::size_t size;  ///< with its header
};
/// Nothing: the bytes begin with no record, or not with all of it, or it is damaged.
std::optional<RecordView> record_at(std::string_view bytes);
/// Do the bytes begin with a header whose record would end within them?
bool claims_to_end_within(std::string_view bytes);
/// Content of the first record of a file.
std::string begin_of(const std::string& file);

/// Where bytes of records go.
using ByteSink = std::function<void(std::string_view)>;

/// Writes one file of records to `sink`, or several one after the other.
class RecordWriter {
 public:
  explicit RecordWriter(ByteSink sink) : sink_(std::move(sink)) {}
  void begin(const std::string& file);
  void add(RecordKind kind, std::string_view content);
  void end() { add(RecordKind::end, ""); }

 private:
  const ByteSink sink_;
};

/// Takes bytes as they come and hands over whole records. Throws DamagedFile that names the record
/// and its place when bytes are damaged, or a record is longer than `most`.
class RecordReader {
 public:
  using Handler = std::function<void(RecordKind, std::string content)>;
  RecordReader(std::int64_t most, Handler handler) : most_(most), handler_(std::move(handler)) {}
  void take(std::string_view bytes);
  /// Nothing follows. Throws DamagedFile when the last file has no end.
  void finish() const;
  /// Of the file that `begin` named last.
  const std::string& file() const { return file_; }

 private:
  bool next();
  void check_order(RecordKind kind, const std::string& content);
  [[noreturn]] void damaged(const std::string& what) const;

  const std::int64_t most_;
  const Handler handler_;
  std::string bytes_, file_;
  std::size_t taken_ = 0;             ///< of `bytes_`
  std::int64_t at_ = 0, number_ = 0;  ///< of the next record
  bool open_ = false;
};

/// What files here are opened with: a pipe in the place of one makes nobody wait.
constexpr int kOpenOwn = O_CLOEXEC | O_NONBLOCK;

/// A regular file that is read from its start on.
class ReadFile {
 public:
  /// Throws StorageError; DamagedFile when there is none, or it is a pipe, a device or a folder.
  explicit ReadFile(const std::string& path);
  ~ReadFile();
  ReadFile(const ReadFile&) = delete;
  ReadFile& operator=(const ReadFile&) = delete;
  /// The next bytes, put into `bytes` as far as they have room; none: its end. Throws StorageError.
  std::string_view read(std::string* bytes) const;

 private:
  const int file_;
};

/// Hands over the bytes of a regular file in pieces. Throws StorageError.
void read_pieces(const std::string& path, const ByteSink& sink);

inline const std::string kUnnamed = ".new";  ///< ending of a file that has not got its name yet

/// A file that is there whole or not at all: under another name until `commit`.
class AtomicFile {
 public:
  /// Throws StorageError.
  explicit AtomicFile(std::string path);
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;
  void write(std::string_view bytes);
  std::int64_t size() const { return size_; }
  /// On the disk, under its name, with its folder's entry. Throws StorageError.
  void commit();

 private:
  const std::string path_;
  int file_ = -1;
  std::int64_t size_ = 0;
};

/// Entries of a folder, or of a file, are on the disk. Throws StorageError.
void sync_path(const std::string& path);

}  // namespace mbcosim::server
