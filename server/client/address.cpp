#include "client/address.h"

#include <grpcpp/support/status_code_enum.h>
#include <sys/stat.h>
#include <sys/un.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <string_view>

#include "client/mbcosim_client.h"

namespace mbcosim::client {
namespace {

constexpr std::string_view kUnix = "unix:";
constexpr std::array<std::string_view, 6> kOfGrpc{
    "dns:", "ipv4:", "ipv6:", "unix-abstract:", "vsock:", "xds:"};

bool begins(const std::string& text, std::string_view with) { return text.rfind(with, 0) == 0; }

bool is_port(std::string_view text) {
  int port = 0;
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, port);
  return error == std::errc() && stop == end && port > 0 && port < 65536;
}

/// Empty: nothing is wrong.
std::string fault_of(const std::string& address) {
  if (begins(address, kUnix)) {
    const std::size_t longest = sizeof(sockaddr_un::sun_path) - 1;
    if (address.size() - kUnix.size() > longest)
      return "the path of a socket has at most " + std::to_string(longest) + " bytes";
    if (address.find(',') != std::string::npos)
      return "a comma in the path of a socket is for gRPC the beginning of another one: choose a "
             "path without";
    return address.find_first_not_of('/', kUnix.size()) == std::string::npos
               ? "it names no socket: expected unix:PATH"
               : "";
  }
  if (std::any_of(kOfGrpc.begin(), kOfGrpc.end(),
                  [&](std::string_view scheme) { return begins(address, scheme); }))
    return "";
  if (begins(address, "http://") || begins(address, "https://"))
    return "that is the address of a page: expected the one that the daemon listens on (--listen), "
           "unix:PATH or HOST:PORT";
  if (address.find("://") == std::string::npos && address.find('/') != std::string::npos)
    return "it is a path without `unix:` before it";
  const std::size_t colon = address.rfind(':');
  if (colon == std::string::npos || colon == 0 || address.find('/') != std::string::npos)
    return "expected unix:PATH or HOST:PORT";
  return is_port(std::string_view(address).substr(colon + 1))
             ? ""
             : "its port must be a number from 1 to 65535";
}

}  // namespace

void check_address(const std::string& address) {
  const std::string fault = fault_of(address);
  if (!fault.empty())
    throw Error("\"" + address.substr(0, 200) + "\" is no address of a server: " + fault,
                static_cast<int>(grpc::StatusCode::INVALID_ARGUMENT), "BAD_ARGUMENT", {},
                "address");
}

std::string why_nobody(const std::string& address) {
  if (!begins(address, kUnix)) return "";
  struct stat info {};
  if (::stat(address.c_str() + kUnix.size(), &info) != 0) return "there is no such socket";
  return S_ISSOCK(info.st_mode) ? "nobody accepts connections there" : "that is no socket";
}

}  // namespace mbcosim::client
