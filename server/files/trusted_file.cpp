#include "files/trusted_file.h"

#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <stdexcept>

namespace mbcosim::server {
namespace {

namespace fs = std::filesystem;

struct stat status_of(const fs::path& path, const std::string& what) {
  struct stat info {};
  if (::stat(path.c_str(), &info) != 0)
    throw std::runtime_error("cannot read " + what + ": " + path.string() + ": " +
                             std::strerror(errno));
  return info;
}

bool is_ours(const struct stat& info) { return info.st_uid == 0 || info.st_uid == ::geteuid(); }

bool others_write(const struct stat& info) { return (info.st_mode & (S_IWGRP | S_IWOTH)) != 0; }

/// "user 1000, neither root nor the daemon's own (10001)"
std::string stranger(const struct stat& info) {
  return "user " + std::to_string(info.st_uid) + ", neither root nor the daemon's own (" +
         std::to_string(::geteuid()) + ")";
}

void check_folder(const std::string& what, const std::string& file, const fs::path& folder) {
  const struct stat info = status_of(folder, what);
  if (!is_ours(info))
    throw std::runtime_error("others may replace " + what + " " + file + ": the folder " +
                             folder.string() + " belongs to " + stranger(info) +
                             ": keep it in a folder of theirs");
  if (others_write(info) && (info.st_mode & S_ISVTX) == 0)
    throw std::runtime_error("others may replace " + what + " " + file + ": they may write the " +
                             "folder " + folder.string() + ": chmod go-w " + folder.string() +
                             ", or keep it elsewhere");
}

void check_folders(const std::string& what, const std::string& file, const fs::path& path) {
  for (fs::path at = path; at != at.parent_path(); at = at.parent_path())
    check_folder(what, file, at.parent_path());
}

}  // namespace

void check_trusted(const std::string& what, const std::string& path) {
  const struct stat info = status_of(path, what);
  if (!is_ours(info))
    throw std::runtime_error(what + " " + path + " belongs to " + stranger(info) +
                             ": who owns it may let anybody in: chown it to one of them");
  if (others_write(info))
    throw std::runtime_error("others than its owner may write " + what + ": chmod go-w " + path);
  check_folders(what, path, fs::absolute(path).lexically_normal());
  std::error_code none;
  const fs::path target = fs::canonical(path, none);
  if (!none) check_folders(what, path, target);
}

}  // namespace mbcosim::server
