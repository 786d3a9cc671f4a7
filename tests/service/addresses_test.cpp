#include "host/addresses.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>

#include <array>

namespace mbcosim::server::addresses_test {
namespace {

TEST(Addresses, OfThisMachineOnly) {
  for (const char* each : {"127.0.0.1:80", "127.1.2.3:80", "localhost:0", "[::1]:80"})
    EXPECT_TRUE(is_loopback(each)) << each;
  for (const char* each : {"0.0.0.0:80", "128.0.0.1:80", "127.evil.example:80", "[::]:80",
                           "localhost.example:80", "127.0.0.1.example:80"})
    EXPECT_FALSE(is_loopback(each)) << each;
}

TEST(Addresses, AreWrittenForGrpc) {
  EXPECT_EQ(channel_target("unix:/a b/c#1?%.sock"), "unix:/a b/c%231%3F%25.sock");
  EXPECT_EQ(channel_target("localhost:80"), "localhost:80");
}

std::string network_of(const char* number) {
  in6_addr address{};
  EXPECT_EQ(::inet_pton(AF_INET6, number, &address), 1);
  keep_network(address);
  std::array<char, INET6_ADDRSTRLEN> text{};
  return ::inet_ntop(AF_INET6, &address, text.data(), text.size());
}

TEST(Addresses, OfOneNetworkOfVersion6AreOneHosts) {
  EXPECT_EQ(network_of("2001:db8:1:2:3:4:5:6"), "2001:db8:1:2::");
  EXPECT_EQ(network_of("2001:db8:1:2:ffff::1"), "2001:db8:1:2::");
  EXPECT_EQ(network_of("2001:db8:1:3::1"), "2001:db8:1:3::");
  EXPECT_EQ(network_of("::ffff:10.0.0.7"), "::ffff:10.0.0.7");
}

TEST(Addresses, HavePortsWhereTheyAreOfIp) {
  sockaddr_storage name{};
  EXPECT_EQ(port_of(name), -1);
  name.ss_family = AF_UNIX;
  EXPECT_EQ(port_of(name), -1);
  auto& v4 = reinterpret_cast<sockaddr_in&>(name);
  v4.sin_family = AF_INET;
  v4.sin_port = htons(8765);
  EXPECT_EQ(port_of(name), 8765);
}

}  // namespace
}  // namespace mbcosim::server::addresses_test
