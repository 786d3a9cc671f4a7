#include "host/addresses.h"

#include <arpa/inet.h>

#include <algorithm>
#include <iterator>

namespace mbcosim::server {

bool is_loopback(const std::string& address) {
  const std::string host = address.substr(0, address.rfind(':'));
  in_addr number{};
  const bool in_loopback_net =
      ::inet_pton(AF_INET, host.c_str(), &number) == 1 && (ntohl(number.s_addr) >> 24) == 127;
  return host == "localhost" || host == "[::1]" || in_loopback_net;
}

std::string channel_target(const std::string& address) {
  if (!address.starts_with("unix:")) return address;
  std::string target;
  for (const char c : address) {
    const bool meant = c == '%' || c == '#' || c == '?';
    target += meant ? "" : std::string(1, c);
    if (meant) target += c == '%' ? "%25" : c == '#' ? "%23" : "%3F";
  }
  return target;
}

int port_of(const sockaddr_storage& name) {
  if (name.ss_family == AF_INET) return ntohs(reinterpret_cast<const sockaddr_in&>(name).sin_port);
  if (name.ss_family != AF_INET6) return -1;
  return ntohs(reinterpret_cast<const sockaddr_in6&>(name).sin6_port);
}

void keep_network(in6_addr& address) {
  constexpr std::size_t kNetwork = 8;  // bytes
  if (!IN6_IS_ADDR_V4MAPPED(&address))
    std::fill(address.s6_addr + kNetwork, std::end(address.s6_addr), std::uint8_t{0});
}

}  // namespace mbcosim::server
