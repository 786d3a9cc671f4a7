/// What a simulation did since its last checkpoint, entry by entry, on the disk.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace mbcosim::server {

class StateFolder;

/// Appends to files "journal-N" of one simulation's folder: one thread at a time. A file that could
/// not be written is cut back to its last entry, and nothing follows before that is done.
class Journal {
 public:
  /// What is there stays; the first entry begins a file of its own. `folder` outlives this.
  Journal(StateFolder& folder, std::string id);
  ~Journal();
  Journal(const Journal&) = delete;
  Journal& operator=(const Journal&) = delete;

  /// On the disk when it returns. Throws StorageError, and nothing of the entry is left.
  void append(std::string_view message, std::string_view state);
  /// The next entry begins a new file.
  void rotate();
  /// Number of the next file: those before it may go when all before `rotate` is stored otherwise.
  int next() const { return next_; }
  std::int64_t bytes() const { return bytes_; }  ///< written since the last `rotate`; any thread

 private:
  void open();
  void mend();
  void write(std::string_view bytes);

  StateFolder& folder_;
  const std::string id_;
  int next_ = 1, file_ = -1;
  std::int64_t good_ = 0;  ///< bytes of the present file that are on the disk
  std::atomic<std::int64_t> bytes_{0};
  bool torn_ = false;   ///< there may be more in the file
  bool named_ = false;  ///< its name is on the disk
};

/// One entry, as `append` was given it.
struct StoredEntry {
  std::string message, state;
};
using EntryHandler = std::function<void(StoredEntry)>;

/// Reads the bytes of a journal's file, whose name is `file`. The start of an entry that follows
/// the last whole one was being written when the daemon was killed, and nobody was told of it.
/// Throws DamagedFile that names the record when anything else is damaged.
void read_journal(std::string_view bytes, const std::string& file, const EntryHandler& handler);

}  // namespace mbcosim::server
