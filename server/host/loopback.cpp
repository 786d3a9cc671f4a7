#include "host/loopback.h"

#include <arpa/inet.h>

namespace mbcosim::server {

bool is_loopback(const std::string& address) {
  const std::string host = address.substr(0, address.rfind(':'));
  in_addr number{};
  const bool in_loopback_net =
      ::inet_pton(AF_INET, host.c_str(), &number) == 1 && (ntohl(number.s_addr) >> 24) == 127;
  return host == "localhost" || host == "[::1]" || in_loopback_net;
}

}  // namespace mbcosim::server
