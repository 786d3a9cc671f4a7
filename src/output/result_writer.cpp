#include "output/result_writer.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>

namespace mbcosim {

Status check_writable(const std::vector<std::string>& paths) {
  for (const std::string& path : paths) {
    std::error_code unknown;
    if (!std::filesystem::exists(path, unknown)) continue;
    const bool folder = std::filesystem::is_directory(path, unknown);
    if (!folder && ::faccessat(AT_FDCWD, path.c_str(), W_OK, AT_EACCESS) == 0) continue;
    return make_error(ErrorKind::io, "OUTPUT_NOT_WRITTEN",
                      "cannot write \"" + path + "\": " + std::strerror(folder ? EISDIR : errno));
  }
  return ok();
}

}  // namespace mbcosim
