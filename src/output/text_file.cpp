#include "output/text_file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>

namespace mbcosim {

namespace {

constexpr std::size_t kBuffer = 1 << 15;

/// An empty file of its own, or a pipe or device; null with `errno`. EWOULDBLOCK: it is another
/// run's, and stays as it is.
std::FILE* opened_alone(const std::string& path) {
  constexpr mode_t kAnybody = 0666;  // but for the umask
  const int file = ::open(path.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, kAnybody);
  if (file < 0) return nullptr;
  struct stat info {};
  const bool shared = ::fstat(file, &info) == 0 && !S_ISREG(info.st_mode);
  // Where the file system has no locks it is as if nobody else were there.
  const bool taken = !shared && ::flock(file, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK;
  if (!taken && (shared || ::ftruncate(file, 0) == 0))
    if (std::FILE* const opened = ::fdopen(file, "wb")) return opened;
  const int why = errno;
  ::close(file);
  errno = why;
  return nullptr;
}

}  // namespace

void TextFile::make_room(std::size_t count) {
  flush();
  if (used_ + count <= capacity_) return;
  capacity_ = std::max(kBuffer, 2 * (used_ + count));
  auto larger = std::make_unique_for_overwrite<char[]>(capacity_);
  std::copy_n(text_.get(), used_, larger.get());
  text_ = std::move(larger);
}

void TextFile::fail(const std::string& why) {
  if (!problem_) return;
  problem_ =
      make_error(ErrorKind::io, "OUTPUT_NOT_WRITTEN", "cannot write \"" + path_ + "\": " + why);
}

void TextFile::fail_budget() { problem_ = over_budget(*budget_); }

void TextFile::create() {
  if (file_ || !problem_) return;
  file_ = opened_alone(path_);
  if (file_)
    std::setvbuf(file_, nullptr, _IONBF, 0);  // the pieces are large already
  else if (errno == EWOULDBLOCK)
    fail("another run is writing it; give each a prefix of its own");
  else
    fail();
}

bool TextFile::flush() {
  if (used_ == 0) return bool(problem_);
  create();
  if (!problem_) return false;
  if (budget_ && !budget_->take(static_cast<std::int64_t>(used_)))
    fail_budget();
  else
    write();
  return bool(problem_);
}

void TextFile::write() {
  const std::size_t written = std::fwrite(text_.get(), 1, used_, file_);
  size_ += static_cast<std::int64_t>(written);
  if (written == used_) {
    used_ = 0;
    return;
  }
  fail();
  end_at_last_line(written);
}

void TextFile::end_at_last_line(std::size_t written) {
  const std::size_t line = std::string_view(text_.get(), written).rfind('\n');
  const std::size_t whole = line == std::string_view::npos ? 0 : line + 1;
  size_ -= static_cast<std::int64_t>(written - whole);
  if (budget_) budget_->give_back(static_cast<std::int64_t>(used_ - whole));
  used_ -= whole;
  std::memmove(text_.get(), text_.get() + whole, used_);
  if (ftruncate(fileno(file_), size_) != 0 || std::fseek(file_, size_, SEEK_SET) != 0) fail();
}

bool TextFile::finish() {
  flush();
  if (file_ && std::fflush(file_) != 0) fail();
  return bool(problem_);
}

bool TextFile::sync() {
  flush();
  if (problem_ && file_ && fsync(fileno(file_)) != 0) fail();
  return bool(problem_);
}

bool TextFile::cut(std::int64_t size) {
  if (size > this->size()) return false;
  problem_ = ok();
  if (size == kNone) {
    remove();
    return true;
  }
  if (size >= size_) {
    used_ = static_cast<std::size_t>(size - size_);
    return true;
  }
  if (ftruncate(fileno(file_), size) != 0) {
    fail();
    return false;
  }
  if (budget_) budget_->give_back(size_ - size);
  size_ = size;
  used_ = 0;
  if (std::fseek(file_, size_, SEEK_SET) != 0) fail();
  return bool(problem_);
}

void TextFile::remove() {
  used_ = 0;
  if (!file_) return;
  std::fclose(file_);
  file_ = nullptr;
  if (budget_) budget_->give_back(size_);
  size_ = 0;
  if (unlink(path_.c_str()) != 0) fail();
}

void TextFile::reopen() {
  file_ = std::fopen(path_.c_str(), "r+b");
  if (!file_) {
    if (errno != ENOENT) fail();
    return;
  }
  std::setvbuf(file_, nullptr, _IONBF, 0);
  if (std::fseek(file_, 0, SEEK_END) != 0 || (size_ = std::ftell(file_)) < 0) return fail();
  if (budget_ && !budget_->take(size_)) fail_budget();
}

}  // namespace mbcosim
