#include "files/default_socket.h"

#include <unistd.h>

#include <cstdlib>
#include <filesystem>

#include "files/trusted_file.h"

namespace mbcosim::server {
namespace {

constexpr const char* kScheme = "unix:";

}  // namespace

std::string default_socket() {
  if (const char* runtime = std::getenv("XDG_RUNTIME_DIR"); runtime && *runtime)
    return kScheme + std::string(runtime) + "/mbcosim.sock";
  return kScheme + std::string("/tmp/mbcosim-") + std::to_string(::getuid()) + "/mbcosim.sock";
}

void check_default_socket(const std::string& address) {
  if (address != default_socket()) return;
  const std::filesystem::path folder =
      std::filesystem::path(address.substr(std::string(kScheme).size())).parent_path();
  std::error_code none;
  if (folder.string().rfind("/tmp/", 0) == 0 && std::filesystem::exists(folder, none))
    check_trusted("the folder of the default socket", folder);
}

}  // namespace mbcosim::server
