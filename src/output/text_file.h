/// Text files of results.
#pragma once

#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <memory>
#include <string>
#include <string_view>

#include "model/diagnostic.h"
#include "output/result_budget.h"

namespace mbcosim {

/// A file that collects text and writes it in large pieces; created with the first byte. What
/// cannot be written whole ends after its last whole line; the rest is kept and can be tried again.
/// Nobody else creates it at the same time.
class TextFile {
 public:
  static constexpr std::int64_t kNone = -1;  ///< size of a file that is not there

  TextFile() = default;
  TextFile(const TextFile&) = delete;
  TextFile& operator=(const TextFile&) = delete;

  /// `budget`: of which the file's bytes are taken; null: without bound.
  void open(std::string path, ResultBudget* budget = nullptr) {
    path_ = std::move(path);
    budget_ = budget;
  }
  ~TextFile() {
    if (file_) std::fclose(file_);
  }
  /// Room for `count` more bytes at the end; `commit` tells how far it was used.
  char* room(std::size_t count) {
    if (used_ + count > capacity_) make_room(count);
    return text_.get() + used_;
  }
  void commit(char* end) { used_ = static_cast<std::size_t>(end - text_.get()); }
  void text(std::string_view s) {
    char* p = room(s.size());
    std::memcpy(p, s.data(), s.size());
    commit(p + s.size());
  }
  const std::string& path() const { return path_; }
  bool flush();
  void create();
  bool finish();
  /// Forgets what went wrong and writes what is left.
  bool retry() {
    problem_ = ok();
    return flush();
  }
  /// Everything is on the disk, not in the system's memory.
  bool sync();

  /// Bytes so far, those that wait included, or kNone.
  std::int64_t size() const {
    return file_ || used_ > 0 ? size_ + static_cast<std::int64_t>(used_) : kNone;
  }
  std::int64_t waiting() const { return static_cast<std::int64_t>(used_); }
  /// Ends the file after so many bytes, and goes on there. False: it has not as many, or cannot be
  /// cut, as `status` tells; then it stays as it is.
  bool cut(std::int64_t size);
  /// Goes on with a file that another TextFile wrote, if it is there.
  void reopen();

  /// ErrorKind::io with the path and the reason, ErrorKind::limit when the budget is used up.
  const Status& status() const { return problem_; }

 private:
  void make_room(std::size_t count);
  void fail(const std::string& why = std::strerror(errno));
  void fail_budget();
  void write();
  void end_at_last_line(std::size_t written);
  void remove();

  std::string path_;
  ResultBudget* budget_ = nullptr;
  std::unique_ptr<char[]> text_;
  std::size_t capacity_ = 0, used_ = 0;
  std::int64_t size_ = 0;  ///< bytes in the file
  std::FILE* file_ = nullptr;
  Status problem_ = ok();
};

}  // namespace mbcosim
