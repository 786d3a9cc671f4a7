#include "shared_memory/channel.h"

#include <poll.h>

#include <cstring>

namespace mbcosim::shm {
namespace {

constexpr auto kLook = std::chrono::milliseconds(10);  // how soon a dead other side is noticed
constexpr std::size_t kLengthBytes = sizeof(std::uint32_t);

int ring_of(Channel::Side side, bool outgoing) {
  return (side == Channel::Side::server) == outgoing ? 0 : 1;
}

}  // namespace

Channel::Channel(Descriptor socket, Segment segment, Side side, std::size_t longest_message)
    : socket_(std::move(socket)),
      segment_(std::move(segment)),
      longest_message_(longest_message),
      writer_(segment_.header(ring_of(side, true)), segment_.bytes(ring_of(side, true)),
              kRingBytes),
      reader_(segment_.header(ring_of(side, false)), segment_.bytes(ring_of(side, false)),
              kRingBytes),
      space_(writer_.bell()),
      data_(reader_.bell()) {}

void Channel::close() {
  closed_.store(true);
  space_.ring_always();
  data_.ring_always();
}

// The socket is silent until the other side ends; whatever comes then is the end.
bool Channel::other_is_gone() const {
  pollfd look{socket_.get(), POLLIN | POLLRDHUP, 0};
  return ::poll(&look, 1, 0) != 0;
}

// ------------------------------------------------------------------ sending

bool Channel::send(const google::protobuf::MessageLite& message, Clock::time_point deadline,
                   const std::function<bool()>& gives_up) {
  const server::Guard guard(send_mutex_);
  const std::size_t size = message.ByteSizeLong();
  if (closed() || size > longest_message_) return false;
  out_.resize(kLengthBytes + size);
  const auto length = static_cast<std::uint32_t>(size);
  std::memcpy(out_.data(), &length, kLengthBytes);
  message.SerializeWithCachedSizesToArray(reinterpret_cast<std::uint8_t*>(&out_[kLengthBytes]));
  const bool sent = write(out_.data(), out_.size(), deadline, gives_up);
  if (!sent) close();
  return sent;
}

bool Channel::write(const char* bytes, std::size_t count, Clock::time_point deadline,
                    const std::function<bool()>& gives_up) {
  while (count > 0) {
    const std::size_t part = std::min(count, writer_.space());
    if (part > 0) {
      writer_.put(bytes, part);
      writer_.publish();
      bytes += part;
      count -= part;
      continue;
    }
    const Clock::time_point now = Clock::now();
    if (closed() || now >= deadline || (gives_up && gives_up())) return false;
    const auto ready = [this, writer = &writer_] { return closed() || writer->space() > 0; };
    const bool room = wait_until(space_, std::min(deadline, now + kLook), ready);
    if (!room && other_is_gone()) return false;
  }
  return true;
}

// ------------------------------------------------------------------ receiving

// Takes what is there of the message under way. True: it is complete.
bool Channel::advance() {
  std::size_t available = reader_.available();
  if (!has_length_) {
    if (available < kLengthBytes) return false;
    std::uint32_t length = 0;
    reader_.take(&length, kLengthBytes);
    if (length > longest_message_) throw Corrupt("a message is too long");
    in_.resize(length);
    received_ = 0;
    has_length_ = true;
    available -= kLengthBytes;
  }
  const std::size_t part = std::min(available, in_.size() - received_);
  reader_.take(in_.data() + received_, part);
  reader_.release();
  received_ += part;
  return received_ == in_.size();
}

bool Channel::parse(google::protobuf::MessageLite* message) {
  if (!advance()) return false;
  has_length_ = false;
  if (!message->ParseFromString(in_)) throw Corrupt("a message cannot be read");
  return true;
}

Channel::Received Channel::receive(google::protobuf::MessageLite* message,
                                   Clock::time_point deadline) {
  const server::Guard guard(receive_mutex_);
  bool last_look = false;
  while (!parse(message)) {
    if (closed() || last_look) return Received::closed;
    const Clock::time_point now = Clock::now();
    if (now >= deadline) return Received::timeout;
    const bool more = wait_for_message(std::min(deadline, now + kLook));
    last_look = !more && other_is_gone();  // what it sent before its end still counts
  }
  return Received::message;
}

// True: some of it is there, or nothing will be.
bool Channel::wait_for_message(Clock::time_point until) {
  const auto ready = [this, reader = &reader_] { return closed() || reader->available() > 0; };
  return for_message_.wait([&] { return look(ready); },
                           [&] { return wait_until(data_, until, ready); });
}

Channel::Received Channel::try_receive(google::protobuf::MessageLite* message) {
  if (!receive_mutex_.try_lock()) return Received::timeout;
  const server::Guard guard(receive_mutex_, std::adopt_lock);
  if (parse(message)) return Received::message;
  return closed() ? Received::closed : Received::timeout;
}

}  // namespace mbcosim::shm
