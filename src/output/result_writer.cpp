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
    const std::filesystem::file_status found = std::filesystem::status(path, unknown);
    if (!std::filesystem::exists(found)) continue;
    const bool folder = std::filesystem::is_directory(found);
    if (!folder && ::faccessat(AT_FDCWD, path.c_str(), W_OK, AT_EACCESS) == 0) continue;
    return make_error(ErrorKind::io, "OUTPUT_NOT_WRITTEN",
                      "cannot write \"" + path + "\": " + std::strerror(folder ? EISDIR : errno));
  }
  return ok();
}

}  // namespace mbcosim
