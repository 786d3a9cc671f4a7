#include "fmi/remote_address.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <string_view>

namespace mbcosim::fmi {
namespace {

constexpr std::string_view kScheme = "http://";

bool all_of(const std::string& text, bool (*fits)(unsigned char)) {
  return !text.empty() && std::all_of(text.begin(), text.end(), fits);
}

bool is_host(const std::string& text) {
  return all_of(text, [](unsigned char c) {
    return (c < 128 && std::isalnum(c)) || c == '.' || c == '-' || c == '_';
  });
}

bool is_ipv6(const std::string& text) {
  return all_of(
      text, [](unsigned char c) { return (c < 128 && std::isxdigit(c)) || c == ':' || c == '.'; });
}

bool is_port(const std::string& text) {
  int port = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), port);
  return error == std::errc() && end == text.data() + text.size() && port >= 1 && port <= 65535;
}

}  // namespace

Result<RemoteAddress> parse_remote(const std::string& address) {
  const auto refuse = [&](const std::string& message) {
    return make_error(ErrorKind::argument, "", message + ", got \"" + address + "\"");
  };
  const std::string wanted = "the daemon's HTTP door is named http://HOST:PORT";
  if (address.rfind("https://", 0) == 0)
    return refuse(wanted +
                  "; it speaks no TLS (to another machine, name the end of a tunnel here)");
  const std::size_t colon = address.rfind(':');
  if (address.rfind(kScheme, 0) != 0 || colon < kScheme.size()) return refuse(wanted);
  RemoteAddress found{address.substr(kScheme.size(), colon - kScheme.size()),
                      address.substr(colon + 1)};
  const bool brackets =
      found.host.size() > 2 && found.host.front() == '[' && found.host.back() == ']';
  if (brackets) found.host = found.host.substr(1, found.host.size() - 2);
  if (!(brackets ? is_ipv6(found.host) : is_host(found.host)) || !is_port(found.port))
    return refuse(wanted);
  return found;
}

}  // namespace mbcosim::fmi
