#include "files/default_socket.h"

#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>

#include "files/trusted_file.h"

namespace mbcosim::server {
namespace {

constexpr const char* kScheme = "unix:";

/// The one in /tmp; empty: the socket is another, or elsewhere.
std::string folder_for_all(const std::string& address) {
  if (address != default_socket()) return "";
  const std::filesystem::path socket = address.substr(std::string(kScheme).size());
  const std::string folder = socket.parent_path();
  return folder.rfind("/tmp/", 0) == 0 ? folder : "";
}

}  // namespace

std::string default_socket() {
  if (const char* runtime = std::getenv("XDG_RUNTIME_DIR"); runtime && *runtime)
    return kScheme + std::string(runtime) + "/mbcosim.sock";
  return kScheme + std::string("/tmp/mbcosim-") + std::to_string(::getuid()) + "/mbcosim.sock";
}

void check_default_socket(const std::string& address) {
  const std::string folder = folder_for_all(address);
  std::error_code none;
  if (!folder.empty() && std::filesystem::exists(folder, none))
    check_trusted("the folder of the default socket", folder);
}

void make_default_folder(const std::string& address) {
  const std::string folder = folder_for_all(address);
  if (folder.empty()) return;
  ::mkdir(folder.c_str(), 0700);
  check_default_socket(address);
}

}  // namespace mbcosim::server
