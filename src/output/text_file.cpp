#include "output/text_file.h"

#include <unistd.h>

#include <cerrno>

namespace mbcosim {

void TextFile::fail() {
  if (error_.empty()) error_ = "cannot write \"" + path_ + "\": " + std::strerror(errno);
}

void TextFile::create() {
  if (file_ || !error_.empty()) return;
  file_ = std::fopen(path_.c_str(), "wb");
  if (file_)
    std::setvbuf(file_, nullptr, _IONBF, 0);  // the pieces are large already
  else
    fail();
}

bool TextFile::flush() {
  if (used_ == 0) return error_.empty();
  create();
  if (error_.empty()) {
    const std::size_t written = std::fwrite(text_.data(), 1, used_, file_);
    size_ += static_cast<long>(written);
    if (written != used_) {
      fail();
      end_at_last_line(written);
    }
  }
  used_ = 0;
  return error_.empty();
}

void TextFile::end_at_last_line(std::size_t written) {
  const std::size_t line = std::string_view(text_.data(), written).rfind('\n');
  const std::size_t whole = line == std::string_view::npos ? 0 : line + 1;
  size_ -= static_cast<long>(written - whole);
  if (ftruncate(fileno(file_), size_) != 0) fail();
}

bool TextFile::finish() {
  flush();
  if (file_ && std::fflush(file_) != 0) fail();
  return error_.empty();
}

}  // namespace mbcosim
