#include "daemon/listener.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <chrono>
#include <future>
#include <mutex>

namespace mbcosim::server::listener_test {
namespace {

using namespace std::chrono_literals;

/// Of whom gRPC would have heard; the first connection takes until `go_on`.
struct Taken {
  std::mutex mutex;
  std::vector<std::string> sources;
  std::promise<void> go_on;
  std::shared_future<void> may_go_on = go_on.get_future().share();

  std::vector<std::string> wait_for(std::size_t count) {
    for (int k = 0; k < 1000; ++k) {
      std::this_thread::sleep_for(10ms);
      const std::lock_guard lock(mutex);
      if (sources.size() >= count) return sources;
    }
    return {};
  }
};

class SlowAcceptor : public Listener::Acceptor {
 public:
  explicit SlowAcceptor(Taken& taken) : taken_(taken) {}
  void HandleNewConnection(NewConnectionParameters* connection) override {
    const shm::Descriptor socket(connection->fd);
    sockaddr_in name{};
    socklen_t size = sizeof name;
    ::getpeername(socket.get(), reinterpret_cast<sockaddr*>(&name), &size);
    {
      const std::lock_guard lock(taken_.mutex);
      taken_.sources.emplace_back(::inet_ntoa(name.sin_addr));
    }
    taken_.may_go_on.wait();
  }

 private:
  Taken& taken_;
};

shm::Descriptor connect_from(const char* source, int port) {
  shm::Descriptor socket(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
  sockaddr_in name{};
  name.sin_family = AF_INET;
  name.sin_addr.s_addr = ::inet_addr(source);
  EXPECT_EQ(::bind(socket.get(), reinterpret_cast<sockaddr*>(&name), sizeof name), 0);
  name.sin_addr.s_addr = ::inet_addr("127.0.0.1");
  name.sin_port = htons(static_cast<std::uint16_t>(port));
  EXPECT_EQ(::connect(socket.get(), reinterpret_cast<sockaddr*>(&name), sizeof name), 0);
  return socket;
}

class ListenerTurns : public testing::Test {
 protected:
  ListenerTurns() { listener_.start(std::make_unique<SlowAcceptor>(taken_)); }
  int port() const { return std::stoi(listener_.bound().substr(listener_.bound().rfind(':') + 1)); }

  Taken taken_;
  Listener listener_{"127.0.0.1:0"};
};

TEST_F(ListenerTurns, AnotherSourceNeedNotWaitForTheCrowdBeforeIt) {
  std::vector<shm::Descriptor> crowd;
  for (int k = 0; k < 20; ++k) crowd.push_back(connect_from("127.0.0.2", port()));
  ASSERT_EQ(taken_.wait_for(1), std::vector<std::string>{"127.0.0.2"});
  const shm::Descriptor probe = connect_from("127.0.0.3", port());
  taken_.go_on.set_value();
  const std::vector<std::string> all = taken_.wait_for(21);
  ASSERT_EQ(all.size(), 21);
  EXPECT_LE(std::find(all.begin(), all.end(), "127.0.0.3") - all.begin(), 2);
}

TEST_F(ListenerTurns, WhoHasGoneMeanwhileTakesNoTime) {
  const shm::Descriptor first = connect_from("127.0.0.2", port());
  ASSERT_EQ(taken_.wait_for(1).size(), 1);
  for (int k = 0; k < 20; ++k) connect_from("127.0.0.2", port());  // and closes
  const shm::Descriptor last = connect_from("127.0.0.3", port());
  taken_.go_on.set_value();
  ASSERT_EQ(taken_.wait_for(2), (std::vector<std::string>{"127.0.0.2", "127.0.0.3"}));
  std::this_thread::sleep_for(50ms);
  EXPECT_EQ(taken_.wait_for(2).size(), 2);
}

}  // namespace
}  // namespace mbcosim::server::listener_test
