/// Threads that take events of gRPC: one as long as it keeps up, more when it does not.
#include "rpc/pollers.h"

#include <grpcpp/alarm.h>
#include <grpcpp/generic/async_generic_service.h>
#include <grpcpp/server_builder.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <functional>
#include <future>
#include <set>
#include <thread>
#include <vector>

namespace mbcosim::server::pollers_test {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr auto kPatience = 20s;

/// An event that comes through the queue at once, as often as it is asked for.
class Bell final : public Pollers::Event {
 public:
  Bell(Pollers& pollers, std::function<void()> rung) : pollers_(pollers), rung_(std::move(rung)) {}
  void ring() { alarm_.Set(&pollers_.queue(), gpr_now(GPR_CLOCK_MONOTONIC), this); }
  void happened(bool ok) override {
    if (ok) rung_();
  }

 private:
  Pollers& pollers_;
  grpc::Alarm alarm_;
  const std::function<void()> rung_;
};

class PollersTest : public testing::Test {
 protected:
  Pollers& pollers() { return pollers_; }
  bool admitted_becomes(int count) const {
    for (const auto end = Clock::now() + kPatience; Clock::now() < end;
         std::this_thread::sleep_for(1ms))
      if (pollers_.admitted() == count) return true;
    return false;
  }
  /// Rings and waits until it has been heard.
  void hear_one() {
    std::promise<void> heard;
    Bell bell(pollers_, [&] { heard.set_value(); });
    bell.ring();
    ASSERT_EQ(heard.get_future().wait_for(kPatience), std::future_status::ready);
  }

 private:
  grpc::ServerBuilder builder_;
  Pollers pollers_{builder_.AddCompletionQueue(), 3};
};

TEST_F(PollersTest, OneThreadTakesAllWhileItKeepsUp) {
  std::set<std::thread::id> threads;
  std::promise<void> heard;
  int count = 0;
  Bell* again = nullptr;
  Bell bell(pollers(), [&] {
    threads.insert(std::this_thread::get_id());
    if (++count == 200)
      heard.set_value();
    else
      again->ring();
  });
  again = &bell;
  bell.ring();
  ASSERT_EQ(heard.get_future().wait_for(kPatience), std::future_status::ready);
  EXPECT_EQ(threads.size(), 1u);
  EXPECT_EQ(pollers().admitted(), 1);
}

// Also when nothing has happened for so long that the watch rests.
TEST_F(PollersTest, AnotherGoesOnWhileOneIsHeldUp) {
  for (const auto pause : {0ms, 1000ms}) {
    std::this_thread::sleep_for(pause);
    std::promise<void> held, free;
    Bell holds(pollers(), [&] {
      held.set_value();
      free.get_future().wait();
    });
    holds.ring();
    ASSERT_EQ(held.get_future().wait_for(kPatience), std::future_status::ready);
    hear_one();
    free.set_value();
    EXPECT_TRUE(admitted_becomes(1)) << pause.count();
  }
}

TEST_F(PollersTest, MoreShareWhatIsTooMuchForOne) {
  std::atomic<bool> enough{false};
  std::atomic<int> ringing{3};
  std::vector<std::unique_ptr<Bell>> bells;
  for (std::size_t k = 0; k < 3; ++k) {
    bells.push_back(std::make_unique<Bell>(pollers(), [&, k] {
      for (const auto end = Clock::now() + 300us; Clock::now() < end;) {
      }
      if (enough)
        --ringing;
      else
        bells[k]->ring();
    }));
  }
  for (const auto& bell : bells) bell->ring();
  const auto start = Clock::now();
  while (pollers().admitted() == 1 && Clock::now() < start + kPatience)
    std::this_thread::sleep_for(1ms);
  EXPECT_GT(pollers().admitted(), 1);
  enough = true;
  while (ringing > 0 && Clock::now() < start + 2 * kPatience) std::this_thread::sleep_for(1ms);
  EXPECT_EQ(ringing, 0);
  EXPECT_TRUE(admitted_becomes(1));
}

// Work that follows work at once: the thread does not sleep between, also when the end comes.
TEST_F(PollersTest, LooksForTheNextPieceOfWork) {
  int count = 0;
  std::promise<void> heard;
  std::atomic<bool> rings{false};
  Bell bell(pollers(), [&] {
    const Pollers::Work work;
    const bool more = ++count < 500;
    rings = more;  // which is taken back at once
    if (!more) heard.set_value();
  });
  std::future<void> all = heard.get_future();
  bell.ring();
  while (all.wait_for(0s) != std::future_status::ready)
    if (rings.exchange(false)) bell.ring();
  pollers().stop();
  EXPECT_EQ(count, 500);
  EXPECT_EQ(pollers().admitted(), 1);
}

/// One side of a pair of sockets is a connection to a server, which reads from it as long as
/// something comes.
class Flood {
  static constexpr std::pair<const char*, const char*> kHeaders[] = {
      {":method", "POST"}, {":scheme", "http"}, {":path", "/a/b"},
      {":authority", "a"}, {"te", "trailers"},  {"content-type", "application/grpc"}};

 public:
  explicit Flood(grpc::experimental::ExternalConnectionAcceptor& acceptor) {
    int pair[2] = {-1, -1};
    EXPECT_EQ(::socketpair(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK, 0, pair), 0);
    grpc::experimental::ExternalConnectionAcceptor::NewConnectionParameters connection;
    connection.fd = pair[0];
    acceptor.HandleNewConnection(&connection);
    socket_ = pair[1];
    thread_ = std::thread([this] { send(); });
  }
  ~Flood() {
    ends_ = true;
    thread_.join();
    ::close(socket_);
  }

 private:
  static std::string frame(char type, char flags, std::uint32_t stream, const std::string& text) {
    std::string out{0, 0, static_cast<char>(text.size()), type, flags};
    for (const int shift : {24, 16, 8, 0}) out += static_cast<char>(stream >> shift);
    return out + text;
  }
  // The preface, then calls that are reset at once.
  void send() {
    const auto text = [](const std::string& of) { return static_cast<char>(of.size()) + of; };
    std::string block;
    for (const auto& [name, value] : kHeaders) block += '\0' + text(name) + text(value);
    std::string out = "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n" + frame(4, 0, 0, "");
    for (std::uint32_t stream = 1; !ends_;) {
      for (; out.size() < (1U << 16); stream += 2)
        out += frame(1, 4, stream, block) + frame(3, 0, stream, std::string("\0\0\0\10", 4));
      const ssize_t sent = ::send(socket_, out.data(), out.size(), MSG_NOSIGNAL);
      if (sent > 0) out.erase(0, static_cast<std::size_t>(sent));
    }
  }
  int socket_ = -1;
  std::atomic<bool> ends_{false};
  std::thread thread_;
};

/// Bells are heard while somebody floods the server, who begins `pause` after its start.
void expect_to_hear_beside_flood(std::chrono::milliseconds pause) {
  grpc::ServerBuilder builder;
  grpc::AsyncGenericService service;
  builder.RegisterAsyncGenericService(&service);
  const auto acceptor = builder.experimental().AddExternalConnectionAcceptor(
      grpc::ServerBuilder::experimental_type::ExternalConnectionType::FROM_FD,
      grpc::InsecureServerCredentials());
  Pollers pollers(builder.AddCompletionQueue(), 2);
  const std::unique_ptr<grpc::Server> server = builder.BuildAndStart();
  std::this_thread::sleep_for(pause);
  {
    const Flood flood(*acceptor);
    std::this_thread::sleep_for(100ms);
    for (int k = 0; k < 10; ++k) {
      std::promise<void> heard;
      Bell bell(pollers, [&] { heard.set_value(); });
      bell.ring();
      ASSERT_EQ(heard.get_future().wait_for(kPatience), std::future_status::ready);
    }
  }
  server->Shutdown();
  pollers.stop();
}

TEST(Pollers, AnotherGoesOnWhileGrpcReadsWithoutEnd) { expect_to_hear_beside_flood(0ms); }

TEST(Pollers, AnotherGoesOnWhenTheWatchHasRested) { expect_to_hear_beside_flood(1000ms); }

/// Where the one that reads gets a small part of a core, also in looks that are far apart.
TEST(Pollers, AnotherGoesOnOnABusyMachine) {
  std::atomic<bool> ends{false};
  std::vector<std::jthread> busy;
  for (unsigned k = 0; k < 6 * std::thread::hardware_concurrency(); ++k)
    busy.emplace_back([&ends] {
      while (!ends) {
      }
    });
  expect_to_hear_beside_flood(1000ms);
  ends = true;
}

TEST_F(PollersTest, WhatAnEventThrowsEndsNoThread) {
  std::promise<void> thrown;
  Bell bell(pollers(), [&] {
    thrown.set_value();
    throw std::runtime_error("from an event");
  });
  bell.ring();
  ASSERT_EQ(thrown.get_future().wait_for(kPatience), std::future_status::ready);
  hear_one();
}

// An alarm that has been set is an event that must come: cancelled, at the latest.
TEST(Pollers, TakesWhatIsLeftAtTheEnd) {
  grpc::ServerBuilder builder;
  std::promise<bool> came;
  struct Last final : Pollers::Event {
    explicit Last(std::promise<bool>& out) : came(out) {}
    void happened(bool ok) override { came.set_value(ok); }
    std::promise<bool>& came;
  } last(came);
  auto alarm = std::make_unique<grpc::Alarm>();
  Pollers pollers(builder.AddCompletionQueue(), 2);
  alarm->Set(&pollers.queue(), std::chrono::system_clock::now() + 1h, &last);
  std::thread cancels([&] {
    std::this_thread::sleep_for(20ms);
    alarm->Cancel();
  });
  pollers.stop();
  EXPECT_FALSE(came.get_future().get());
  cancels.join();
}

}  // namespace
}  // namespace mbcosim::server::pollers_test
