/// Text files of results.
#pragma once

#include <cstdio>
#include <cstring>
#include <string>
#include <string_view>

namespace mbcosim {

/// A file that collects text and writes it in large pieces; created with the first byte. What
/// cannot be written whole ends after its last whole line.
class TextFile {
 public:
  static constexpr std::size_t kBuffer = 1 << 16;

  TextFile() = default;
  TextFile(const TextFile&) = delete;
  TextFile& operator=(const TextFile&) = delete;

  void open(std::string path) { path_ = std::move(path); }
  ~TextFile() {
    if (file_) std::fclose(file_);
  }
  /// Room for `count` more bytes at the end; `commit` tells how far it was used.
  char* room(std::size_t count) {
    if (text_.empty()) text_.resize(kBuffer);
    if (used_ + count > text_.size()) flush();
    if (count > text_.size()) text_.resize(2 * count);
    return text_.data() + used_;
  }
  void commit(char* end) { used_ = static_cast<std::size_t>(end - text_.data()); }
  void text(std::string_view s) {
    char* p = room(s.size());
    std::memcpy(p, s.data(), s.size());
    commit(p + s.size());
  }
  bool flush();
  void create();
  bool finish();
  /// What went wrong with which path; empty: nothing.
  const std::string& error() const { return error_; }

 private:
  void fail();
  void end_at_last_line(std::size_t written);

  std::string path_;
  std::string text_;
  std::size_t used_ = 0;
  long size_ = 0;  ///< bytes in the file
  std::FILE* file_ = nullptr;
  std::string error_;
};

}  // namespace mbcosim
