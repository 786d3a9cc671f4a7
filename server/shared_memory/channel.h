/// Messages between two processes of one host over a pair of rings in shared memory.
///
/// A Unix socket (mode 0600, packets) brings the two together: the client sends a `Request`, the
/// server answers with the memory's file descriptor. The memory has no name, so nothing is left
/// behind by a process that is killed, and it is sealed, so that nobody can shrink it under the
/// other. From then on messages travel through the rings; the socket stays open to tell each side
/// of the other's death, and brings the status with which the server ends.
#pragma once

#include <google/protobuf/message_lite.h>

#include <atomic>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "shared_memory/ring.h"
#include "threads/alertness.h"
#include "threads/mutex.h"

namespace mbcosim::shm {

constexpr std::size_t kRingBytes = 1 << 20;  ///< each way; longer messages pass in parts

/// Owns a file descriptor.
class Descriptor {
 public:
  explicit Descriptor(int fd = -1) : fd_(fd) {}
  Descriptor(Descriptor&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    std::swap(fd_, other.fd_);
    return *this;
  }
  ~Descriptor();
  int get() const { return fd_; }
  int release() { return std::exchange(fd_, -1); }
  explicit operator bool() const { return fd_ >= 0; }

 private:
  int fd_;
};

/// Two rings in a mapping of shared memory.
class Segment {
 public:
  /// New memory. Throws std::system_error.
  static Segment create();
  /// Memory that a server made; checks its size and seals. Throws Corrupt or std::system_error.
  static Segment open(Descriptor fd);
  Segment(Segment&& other) noexcept = default;
  Segment& operator=(Segment&&) = delete;
  ~Segment();

  int descriptor() const { return fd_.get(); }
  /// Ring 0 leads from the server to the client.
  RingHeader* header(int ring) const;
  std::byte* bytes(int ring) const;

 private:
  Segment(Descriptor fd, void* base);
  struct Unmap {
    void operator()(void* base) const;
  };
  Descriptor fd_;
  std::unique_ptr<void, Unmap> base_;
};

/// "unix:PATH" → "PATH.shm", where the same server offers shared memory; other addresses → "".
std::string rendezvous_path(const std::string& address);

/// What a client asks with.
struct Request {
  std::string authorization;  ///< "Bearer …", or empty
};
/// How the server ended: `bytes` of a `google.rpc.Status` beside its code.
struct Status {
  int code = 0;
  std::string bytes = {};
};
/// Client: asks for the memory; nothing: the server refused with that status. Throws
/// std::system_error or Corrupt.
std::optional<Segment> request_segment(int socket, const Request& request, Status* refusal);
/// Server: reads the request; false: it is none.
bool read_request(int socket, Request* request);
/// Server: hands the memory over.
bool send_segment(int socket, const Segment& segment);
/// Server, last.
void send_status(int socket, const Status& status);
/// Client, after the end. Nothing: the server ended without one.
std::optional<Status> receive_status(int socket);

/// One end. Sending and receiving may happen at the same time; several senders take turns, and so
/// do several receivers.
class Channel {
 public:
  enum class Side { server, client };
  enum class Received { message, timeout, closed };
  Channel(Descriptor socket, Segment segment, Side side, std::size_t longest_message);

  int socket() const { return socket_.get(); }
  /// False: the other side is gone, or did not read until the deadline; the channel is closed then.
  /// `gives_up`: asked now and then; as if the deadline were over.
  bool send(const google::protobuf::MessageLite& message, Clock::time_point deadline,
            const std::function<bool()>& gives_up = {});
  /// Throws Corrupt when the other side broke the protocol.
  Received receive(google::protobuf::MessageLite* message, Clock::time_point deadline);
  /// A look without waiting; also `timeout` while another thread receives.
  Received try_receive(google::protobuf::MessageLite* message);
  /// Any thread: wakes who waits here, nothing is sent or received any more.
  void close();
  bool closed() const { return closed_.load(std::memory_order_relaxed); }

 private:
  bool wait_for_message(Clock::time_point until) TS_REQUIRES(receive_mutex_);
  bool write(const char* bytes, std::size_t count, Clock::time_point deadline,
             const std::function<bool()>& gives_up) TS_REQUIRES(send_mutex_);
  bool advance() TS_REQUIRES(receive_mutex_);
  bool parse(google::protobuf::MessageLite* message) TS_REQUIRES(receive_mutex_);
  bool other_is_gone() const;

  Descriptor socket_;
  Segment segment_;
  const std::size_t longest_message_;
  server::Mutex send_mutex_, receive_mutex_;
  RingWriter writer_ TS_GUARDED_BY(send_mutex_);
  RingReader reader_ TS_GUARDED_BY(receive_mutex_);
  server::Alertness for_message_ TS_GUARDED_BY(receive_mutex_);
  Bell &space_, &data_;  ///< of `writer_` and `reader_`
  std::string out_ TS_GUARDED_BY(send_mutex_), in_ TS_GUARDED_BY(receive_mutex_);  ///< under way
  std::size_t received_ TS_GUARDED_BY(receive_mutex_) = 0;  ///< bytes of `in_` that are there
  bool has_length_ TS_GUARDED_BY(receive_mutex_) = false;   ///< `in_` has its final size
  std::atomic<bool> closed_{false};
};

}  // namespace mbcosim::shm
