#include "files/folder_size.h"

#include <filesystem>

namespace mbcosim::server {

namespace fs = std::filesystem;

std::int64_t bytes_of_file(const std::string& path) {
  std::error_code none;
  const auto size = fs::file_size(path, none);
  return none ? 0 : static_cast<std::int64_t>(size);
}

std::int64_t bytes_in(const std::string& folder) {
  std::int64_t bytes = 0;
  std::error_code error;
  for (fs::recursive_directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error)) {
    std::error_code none;
    if (!entry->is_symlink(none) && entry->is_regular_file(none))
      bytes += bytes_of_file(entry->path());
  }
  return bytes;
}

}  // namespace mbcosim::server
