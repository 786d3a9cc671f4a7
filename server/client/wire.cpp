#include "client/wire.h"

#include <sys/socket.h>
#include <sys/un.h>

#include <cstring>
#include <system_error>

#include "client/wakeful_stream.h"
#include "shared_memory/channel.h"

namespace mbcosim::client {
namespace {

constexpr std::size_t kLongestMessage = std::size_t{1} << 30;
constexpr int kBoundSeconds = 5;                 // of the handshake
constexpr auto kLook = std::chrono::seconds(1);  // rounds of an endless wait

class GrpcWire : public Wire {
 public:
  GrpcWire(const Server::Impl& server, const std::string& simulation)
      : stream_(server, simulation, [&](auto* context, auto* queue) {
          return server.coupling->PrepareAsyncAttach(context, queue);
        }) {}
  bool write(const v1::PeerMessage& message) override { return stream_.write(message); }
  bool read(v1::ServerMessage* message) override { return stream_.read(message); }
  void part() override { stream_.end_writing(); }
  void cancel() override { stream_.cancel(); }
  grpc::Status finish() override { return stream_.finish(); }

 private:
  WakefulStream<v1::PeerMessage, v1::ServerMessage> stream_;
};

class SharedMemoryWire : public Wire {
 public:
  SharedMemoryWire(shm::Descriptor socket, shm::Segment segment, double timeout)
      : channel_(std::move(socket), std::move(segment), shm::Channel::Side::client,
                 kLongestMessage),
        timeout_(std::chrono::milliseconds(static_cast<std::int64_t>(1000 * timeout))) {}
  bool write(const v1::PeerMessage& message) override {
    try {
      return channel_.send(message, shm::Clock::now() + timeout_);
    } catch (const shm::Corrupt&) {
      return false;
    }
  }
  bool read(v1::ServerMessage* message) override {
    using Received = shm::Channel::Received;
    try {
      Received received = Received::timeout;
      while (received == Received::timeout)
        received = channel_.receive(message, shm::Clock::now() + kLook);
      return received == Received::message;
    } catch (const shm::Corrupt&) {
      return false;
    }
  }
  void part() override { cancel(); }
  void cancel() override {
    channel_.close();
    ::shutdown(channel_.socket(), SHUT_WR);
  }
  grpc::Status finish() override {
    const timeval bound{kPartingSeconds, 0};
    ::setsockopt(channel_.socket(), SOL_SOCKET, SO_RCVTIMEO, &bound, sizeof bound);
    const auto status = shm::receive_status(channel_.socket());
    if (!status) return {grpc::StatusCode::UNAVAILABLE, "the server is gone"};
    return to_grpc(*status);
  }

  static grpc::Status to_grpc(const shm::Status& status) {
    v1::ErrorStatus details;
    details.ParseFromString(status.bytes);
    return {static_cast<grpc::StatusCode>(status.code), details.message(), status.bytes};
  }

 private:
  shm::Channel channel_;
  const shm::Clock::duration timeout_;
};

[[noreturn]] void fail(const std::string& message) {
  throw Error(message, static_cast<int>(grpc::StatusCode::UNAVAILABLE), "", {});
}

shm::Descriptor connect_to(const std::string& path) {
  sockaddr_un name{};
  name.sun_family = AF_UNIX;
  if (path.size() >= sizeof name.sun_path) fail("the socket's path is too long: " + path);
  std::memcpy(name.sun_path, path.c_str(), path.size() + 1);
  shm::Descriptor socket(::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0));
  const timeval bound{kBoundSeconds, 0};  // a stopped server must not stop its clients
  ::setsockopt(socket.get(), SOL_SOCKET, SO_RCVTIMEO, &bound, sizeof bound);
  ::setsockopt(socket.get(), SOL_SOCKET, SO_SNDTIMEO, &bound, sizeof bound);
  if (::connect(socket.get(), reinterpret_cast<const sockaddr*>(&name), sizeof name) != 0)
    fail("no server offers shared memory at " + path + ": " + std::strerror(errno));
  return socket;
}

}  // namespace

std::unique_ptr<Wire> open_stream(Server::Impl& server, const std::string& simulation) {
  return std::make_unique<GrpcWire>(server, simulation);
}

std::unique_ptr<Wire> open_shared_memory(const Server::Impl& server, double timeout) {
  const std::string path = shm::rendezvous_path(server.address);
  if (path.empty())
    throw Error("shared memory needs a server at unix:PATH on this host, not " + server.address,
                static_cast<int>(grpc::StatusCode::INVALID_ARGUMENT), "", {});
  try {
    shm::Descriptor socket = connect_to(path);
    shm::Status refusal;
    std::optional<shm::Segment> segment =
        shm::request_segment(socket.get(), {server.authorization}, &refusal);
    if (!segment) require(SharedMemoryWire::to_grpc(refusal));
    if (!segment) fail("the server refused without a reason");
    return std::make_unique<SharedMemoryWire>(std::move(socket), std::move(*segment), timeout);
  } catch (const std::system_error& error) {
    fail(error.what());
  } catch (const shm::Corrupt& corrupt) {
    fail(corrupt.what());
  }
}

}  // namespace mbcosim::client
