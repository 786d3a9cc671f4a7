#include "input/sources.h"

#include <sys/stat.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <memory>
#include <optional>
#include <system_error>

namespace mbcosim {

namespace fs = std::filesystem;

namespace {

Error io_error(std::string message) {
  return make_error(ErrorKind::io, "FILE", std::move(message));
}

std::string quote(const std::string& name) { return '"' + name + '"'; }

bool leads_out(const fs::path& name) {
  if (name.is_absolute() || name.has_root_name()) return true;
  int depth = 0;
  for (const fs::path& part : name) {
    if (part == "..")
      --depth;
    else if (part != "." && !part.empty())
      ++depth;
    if (depth < 0) return true;
  }
  return false;
}

/// Is `path` (canonical) below `folder` (canonical)?
bool is_below(const fs::path& path, const fs::path& folder) {
  auto p = path.begin();
  for (const fs::path& part : folder) {
    if (part.empty()) continue;
    if (p == path.end() || *p != part) return false;
    ++p;
  }
  return true;
}

constexpr std::size_t kLargestStream = 256 << 20;  ///< [bytes]

/// All that a pipe, or a terminal, says until it ends.
Result<std::string> read_stream(std::FILE* in, const std::string& name) {
  std::string text;
  char piece[1 << 16];
  while (const std::size_t size = std::fread(piece, 1, sizeof piece, in)) {
    if (text.size() + size > kLargestStream)
      return io_error(quote(name) + " does not end: 256 MiB were read");
    text.append(piece, size);
  }
  if (std::ferror(in)) return io_error("cannot read " + quote(name) + ": " + std::strerror(errno));
  return text;
}

/// The same for all names of a file: its device and its number there.
using FileIdentity = std::pair<dev_t, ino_t>;

/// Without a value: there is no such file.
std::optional<FileIdentity> identity_of(const std::string& path) {
  struct stat found;
  if (::stat(path.c_str(), &found) != 0) return std::nullopt;
  return FileIdentity(found.st_dev, found.st_ino);
}

}  // namespace

FolderSource::FolderSource(std::string folder, bool unrestricted)
    : folder_(std::move(folder)), unrestricted_(unrestricted) {}

Result<std::string> FolderSource::read(const std::string& name) const {
  if (name.empty() || name.find('\0') != std::string::npos)
    return io_error("cannot open " + quote(name));
  if (!unrestricted_ && leads_out(name))
    return io_error(quote(name) + " is outside the allowed folder");
  std::error_code ec;
  const auto closed = [&](const std::string& reason) {
    return io_error("cannot open " + quote(name) + (unrestricted_ ? ": " + reason : ""));
  };
  fs::path path = fs::path(folder_) / name;
  if (!unrestricted_) {
    const fs::path folder = fs::canonical(folder_.empty() ? "." : folder_, ec);
    if (ec) return closed(ec.message());
    path = fs::canonical(path, ec);
    if (ec) return closed(ec.message());
    if (!is_below(path, folder)) return io_error(quote(name) + " is outside the allowed folder");
  }
  const fs::file_status found = fs::status(path, ec);
  if (ec) return closed(ec.message());
  const bool is_stream = unrestricted_ && (fs::is_fifo(found) || fs::is_character_file(found));
  if (!fs::is_regular_file(found) && !is_stream)
    return io_error(quote(name) + " is not a regular file");
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> in(std::fopen(path.c_str(), "rb"),
                                                           &std::fclose);
  if (!in) return closed(std::strerror(errno));
  if (is_stream) return read_stream(in.get(), name);
  std::string text;
  const auto size = fs::file_size(path, ec);
  if (!ec) text.resize(size);
  text.resize(std::fread(text.data(), 1, text.size(), in.get()));
  return text;
}

std::string file_in_both(const std::vector<std::string>& inputs,
                         const std::vector<std::string>& outputs) {
  std::map<FileIdentity, std::string> found;
  for (const std::string& input : inputs)
    if (const auto identity = identity_of(input)) found.emplace(*identity, input);
  for (const std::string& output : outputs)
    if (const auto identity = identity_of(output))
      if (const auto same = found.find(*identity); same != found.end()) return same->second;
  return {};
}

Result<std::string> BundleSource::read(const std::string& name) const {
  const auto it = files_.find(name);
  if (it != files_.end()) return it->second;
  if (leads_out(name)) return io_error(quote(name) + " is outside the allowed folder");
  return io_error("cannot open " + quote(name));
}

}  // namespace mbcosim
