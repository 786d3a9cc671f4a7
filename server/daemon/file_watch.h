/// Whether a file is another one than before.
#pragma once

#include <sys/stat.h>

#include <cstdint>
#include <string>
#include <utility>

namespace mbcosim::server {

class FileWatch {
 public:
  explicit FileWatch(std::string path) : path_(std::move(path)), last_(look()) {}
  /// Since the last call, or the beginning. One that is not there has not changed.
  bool has_changed() {
    const Look now = look();
    if (now == last_ || now == Look()) return false;
    last_ = now;
    return true;
  }

 private:
  struct Look {
    ino_t inode = 0;
    off_t size = 0;
    std::int64_t seconds = 0, nanoseconds = 0;  ///< of its last change, that of rights included
    bool operator==(const Look&) const = default;
  };
  Look look() const {
    struct stat info {};
    if (::stat(path_.c_str(), &info) != 0) return {};
    return {info.st_ino, info.st_size, info.st_ctim.tv_sec, info.st_ctim.tv_nsec};
  }

  const std::string path_;
  Look last_;
};

}  // namespace mbcosim::server
