#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <unistd.h>

#include <thread>

#include "mbcosim/v1/coupling.pb.h"
#include "shared_memory/channel.h"

namespace mbcosim::shm::shared_memory_test {
namespace {

using std::chrono::milliseconds;
using Received = Channel::Received;
constexpr std::size_t kLongest = 16 << 20;

/// Both ends, mapped twice as in two processes.
struct Pair {
  explicit Pair(std::size_t longest = kLongest) {
    int ends[2];
    if (::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends) != 0) std::abort();
    Segment segment = Segment::create();
    Segment mirror = Segment::open(Descriptor(::dup(segment.descriptor())));
    raw = std::make_unique<Segment>(Segment::open(Descriptor(::dup(segment.descriptor()))));
    server = std::make_unique<Channel>(Descriptor(ends[0]), std::move(segment),
                                       Channel::Side::server, longest);
    client = std::make_unique<Channel>(Descriptor(ends[1]), std::move(mirror),
                                       Channel::Side::client, kLongest);
  }
  std::unique_ptr<Segment> raw;  ///< for what a wrong process may do
  std::unique_ptr<Channel> server, client;
};

v1::PeerMessage message_of(int numbers, std::int64_t index) {
  v1::PeerMessage message;
  message.mutable_exchange()->set_index(index);
  for (int i = 0; i < numbers; ++i)
    message.mutable_exchange()->mutable_answer()->add_signals(i + double(index));
  return message;
}

Clock::time_point in(milliseconds wait) { return Clock::now() + wait; }

TEST(SharedMemory, MessagesOfAllSizesArriveInOrder) {
  Pair pair;
  const std::vector<int> sizes = {0, 1, 2, 100, 131070, 131072, 400000, 3, 0, 65536, 65536, 65536};
  std::thread writer([&] {
    for (int round = 0; round < 20; ++round)
      for (std::size_t k = 0; k < sizes.size(); ++k)
        EXPECT_TRUE(
            pair.client->send(message_of(sizes[k], std::int64_t(k)), in(milliseconds(10000))));
  });
  v1::PeerMessage message;
  for (int round = 0; round < 20; ++round) {
    for (std::size_t k = 0; k < sizes.size(); ++k) {
      ASSERT_EQ(pair.server->receive(&message, in(milliseconds(10000))), Received::message);
      ASSERT_EQ(message.exchange().index(), std::int64_t(k));
      ASSERT_EQ(message.exchange().answer().signals_size(), sizes[k]);
      if (sizes[k] > 0) {
        ASSERT_EQ(message.exchange().answer().signals(sizes[k] - 1), sizes[k] - 1 + double(k));
      }
    }
  }
  writer.join();
}

TEST(SharedMemory, PingPongWithSleepersInBetween) {
  Pair pair;
  std::thread echo([&] {
    v1::PeerMessage message;
    while (pair.client->receive(&message, in(milliseconds(5000))) == Received::message)
      pair.client->send(message, in(milliseconds(1000)));
  });
  v1::PeerMessage message;
  for (int k = 0; k < 2000; ++k) {
    if (k % 100 == 0) std::this_thread::sleep_for(milliseconds(1));  // longer than the spin
    ASSERT_TRUE(pair.server->send(message_of(3, k), in(milliseconds(1000))));
    ASSERT_EQ(pair.server->receive(&message, in(milliseconds(5000))), Received::message);
    ASSERT_EQ(message.exchange().index(), k);
  }
  pair.server.reset();
  echo.join();
}

TEST(SharedMemory, WaitsAreBounded) {
  Pair pair;
  v1::PeerMessage message;
  const auto start = Clock::now();
  EXPECT_EQ(pair.server->receive(&message, in(milliseconds(50))), Received::timeout);
  EXPECT_EQ(pair.server->try_receive(&message), Received::timeout);
  while (pair.server->send(message_of(10000, 1), in(milliseconds(50)))) {
  }
  EXPECT_TRUE(pair.server->closed());
  EXPECT_FALSE(pair.server->send(message_of(1, 1), in(milliseconds(50))));
  EXPECT_LT(Clock::now() - start, milliseconds(2000));
}

TEST(SharedMemory, TheEndOfTheOtherSideIsNoticedAndItsLastWordsAreRead) {
  Pair pair;
  ASSERT_TRUE(pair.client->send(message_of(2, 7), in(milliseconds(100))));
  pair.client.reset();  // what the kernel does for a killed process
  v1::PeerMessage message;
  const auto start = Clock::now();
  EXPECT_EQ(pair.server->receive(&message, in(milliseconds(5000))), Received::message);
  EXPECT_EQ(pair.server->receive(&message, in(milliseconds(5000))), Received::closed);
  while (pair.server->send(message_of(100000, 1), in(milliseconds(5000)))) {
  }
  EXPECT_LT(Clock::now() - start, milliseconds(1000));
}

TEST(SharedMemory, ClosingWakesWhoWaits) {
  Pair pair;
  std::thread reader([&] {
    v1::PeerMessage message;
    EXPECT_EQ(pair.server->receive(&message, in(milliseconds(20000))), Received::closed);
  });
  std::this_thread::sleep_for(milliseconds(30));
  const auto start = Clock::now();
  pair.server->close();
  reader.join();
  EXPECT_LT(Clock::now() - start, milliseconds(1000));
}

TEST(SharedMemory, WrongCountersAndLengthsAreRefused) {
  constexpr int kToServer = 1;
  v1::PeerMessage message;
  {
    Pair pair;
    pair.raw->header(kToServer)->written.store(kRingBytes + 1);
    EXPECT_THROW(pair.server->receive(&message, in(milliseconds(100))), Corrupt);
  }
  {
    Pair pair;
    pair.raw->header(0)->read.store(1);  // more than was written
    EXPECT_THROW(pair.server->send(message_of(1, 1), in(milliseconds(100))), Corrupt);
  }
  {
    Pair pair(/*longest=*/100);
    ASSERT_TRUE(pair.client->send(message_of(100, 1), in(milliseconds(100))));
    EXPECT_THROW(pair.server->receive(&message, in(milliseconds(100))), Corrupt);
  }
  {
    Pair pair;
    const char garbage[] = {4, 0, 0, 0, 'a', 'b', 'c', 'd'};
    std::copy(std::begin(garbage), std::end(garbage),
              reinterpret_cast<char*>(pair.raw->bytes(kToServer)));
    pair.raw->header(kToServer)->written.store(sizeof garbage);
    EXPECT_THROW(pair.server->receive(&message, in(milliseconds(100))), Corrupt);
  }
}

TEST(SharedMemory, MemoryOfAnotherSizeOrThatCanShrinkIsRefused) {
  Descriptor other(::memfd_create("other", MFD_CLOEXEC | MFD_ALLOW_SEALING));
  EXPECT_THROW(Segment::open(Descriptor(::dup(other.get()))), Corrupt);
  const Segment segment = Segment::create();
  ASSERT_EQ(::ftruncate(other.get(), ::lseek(segment.descriptor(), 0, SEEK_END)), 0);
  EXPECT_THROW(Segment::open(Descriptor(::dup(other.get()))), Corrupt);
  EXPECT_NE(::ftruncate(segment.descriptor(), 10), 0);  // sealed
}

TEST(SharedMemory, Addresses) {
  EXPECT_EQ(rendezvous_path("unix:/run/a.sock"), "/run/a.sock.shm");
  EXPECT_EQ(rendezvous_path("unix:///run/a.sock"), "/run/a.sock.shm");
  EXPECT_EQ(rendezvous_path("localhost:1"), "");
}

}  // namespace
}  // namespace mbcosim::shm::shared_memory_test
