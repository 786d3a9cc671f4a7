/// Typed methods: what a call is made of, so that a handler converts, calls and converts back.
#pragma once

#include <grpcpp/impl/codegen/proto_utils.h>
#include <grpcpp/support/byte_buffer.h>

#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "rpc/exchange.h"

namespace mbcosim::server {

/// Bytes of a message that is taken by the poller and not counted.
inline constexpr std::size_t kShortMessage = 4096;

/// The bytes in one piece.
std::string joined(const grpc::ByteBuffer& bytes);

/// Throws BAD_ARGUMENT when the bytes are no such message. Large ones are counted: a message may
/// take hundreds of times its bytes. `share` holds what it takes.
template <class Message>
void parse(MemoryBudget& memory, grpc::ByteBuffer& bytes, Message* message, MemoryShare* share) {
  bool good = false;
  if (bytes.Length() <= kShortMessage) {
    good = grpc::SerializationTraits<Message>::Deserialize(&bytes, message).ok();
  } else {
    const MemoryShare whole(memory, static_cast<std::int64_t>(bytes.Length()));
    const std::string text = joined(bytes);
    bytes.Clear();
    good = within(memory, nullptr, share, [&] { return message->ParseFromString(text); });
  }
  if (!good)
    throw Refusal(v1::REASON_BAD_ARGUMENT,
                  "the message is no " + std::string(Message::descriptor()->full_name()));
}

template <class Message>
grpc::ByteBuffer serialized(const Message& message) {
  grpc::ByteBuffer bytes;
  bool own = false;
  const grpc::Status status = grpc::SerializationTraits<Message>::Serialize(message, &bytes, &own);
  if (!status.ok()) throw Refusal(v1::REASON_INTERNAL, "an answer cannot be serialized");
  return bytes;
}

/// The method's work: who calls, and what tells it to stop.
struct CallFrame {
  const Caller& caller;
  Call& call;
  MemoryBudget& memory;
  MemoryShare& share;  ///< what the call takes until it is over
};

inline CallFrame frame_of(Exchange& exchange, MemoryShare& share) {
  return {exchange.caller(), exchange.call(), exchange.memory(), share};
}

/// One message in.
template <class Request>
class OneRequest : public Handler {
 public:
  explicit OneRequest(Lane lane) : lane_(lane) {}
  void on_message(Exchange& exchange, grpc::ByteBuffer message) override {
    if (message.Length() <= kShortMessage && may_be_quick()) return try_at_once(exchange, message);
    exchange.post(lane_, [this, &exchange, bytes = std::move(message)]() mutable {
      take(exchange, bytes);
      labelled(exchange, [&] { serve(exchange, request_); });
    });
  }
  void on_half_close(Exchange&) override {
    throw Refusal(v1::REASON_OUT_OF_TURN, "the call came without its message");
  }

 protected:
  virtual void serve(Exchange& exchange, const Request& request) = 0;
  /// Is `serve_at_once` worth a try?
  virtual bool may_be_quick() const { return false; }
  /// The same as `serve` on a poller's thread, when it takes but a moment and waits for nobody.
  /// False: it might not, and nothing has been done.
  virtual bool serve_at_once(Exchange&, const Request&) { return false; }
  Lane lane() const { return lane_; }
  MemoryShare& share() { return share_; }

 private:
  // Another thread would take as long to wake as quick work does.
  void try_at_once(Exchange& exchange, grpc::ByteBuffer& message) {
    exchange.do_at_once([&] {
      take(exchange, message);
      bool done = false;
      labelled(exchange, [&] { done = serve_at_once(exchange, request_); });
      if (done) return;
      exchange.post(lane_,
                    [this, &exchange] { labelled(exchange, [&] { serve(exchange, request_); }); });
    });
  }
  void take(Exchange& exchange, grpc::ByteBuffer& message) {
    share_ = MemoryShare(exchange.memory());
    parse(exchange.memory(), message, &request_, &share_);
    message.Clear();
  }
  template <class Work>
  void labelled(const Exchange& exchange, Work work) const {
    CallLabels labels = exchange.labels();
    if constexpr (requires { request_.request_id(); }) labels.request_id = request_.request_id();
    const CallScope scope(labels);
    work();
  }

  const Lane lane_;
  MemoryShare share_;  ///< of the request, and of what is made for it
  Request request_;
};

/// One message in, one out.
template <class Request, class Reply>
class Unary final : public OneRequest<Request> {
 public:
  using Body = std::function<void(const CallFrame&, const Request&, Reply*)>;
  /// See `serve_at_once`; may be null.
  using AtOnce = std::function<bool(const CallFrame&, const Request&, Reply*)>;
  Unary(Lane lane, Body body, AtOnce at_once)
      : OneRequest<Request>(lane), body_(std::move(body)), at_once_(std::move(at_once)) {}

 private:
  void serve(Exchange& exchange, const Request& request) override {
    Reply reply;
    body_(frame_of(exchange, this->share()), request, &reply);
    exchange.end(serialized(reply));
  }
  bool may_be_quick() const override { return at_once_ != nullptr; }
  bool serve_at_once(Exchange& exchange, const Request& request) override {
    Reply reply;
    if (!at_once_(frame_of(exchange, this->share()), request, &reply)) return false;
    exchange.end(serialized(reply));
    return true;
  }
  const Body body_;
  const AtOnce at_once_;
};

/// What the source of a series has: nothing more, a message, or the one after which there is none.
enum class Next { nothing, message, last };

/// One message in, a series out: the next is made when the client has taken the last.
template <class Request, class Reply>
class Series final : public OneRequest<Request> {
 public:
  /// Fills the next message, if there is one.
  using Source = std::function<Next(Reply*)>;
  using Body = std::function<Source(const CallFrame&, const Request&)>;
  Series(Lane lane, Body body) : OneRequest<Request>(lane), body_(std::move(body)) {}

 private:
  void serve(Exchange& exchange, const Request& request) override {
    source_ = body_(frame_of(exchange, this->share()), request);
    go_on(exchange);
  }
  void on_written(Exchange& exchange) override {
    exchange.post(this->lane(), [this, &exchange] { go_on(exchange); });
  }
  void go_on(Exchange& exchange) {
    Reply reply;
    switch (source_(&reply)) {
      case Next::nothing:
        return exchange.finish(grpc::Status::OK);
      case Next::message:
        return exchange.write(serialized(reply));
      case Next::last:
        return exchange.end(serialized(reply));
    }
  }
  const Body body_;
  Source source_;
};

/// Many messages in until the client closes its side, then the work.
template <class Request>
class Upload : public Handler {
 public:
  void on_message(Exchange& exchange, grpc::ByteBuffer message) override {
    exchange.post(Lane::work, [this, &exchange, bytes = std::move(message)]() mutable {
      MemoryShare share;
      Request request;
      parse(exchange.memory(), bytes, &request, &share);
      add(exchange, request, std::move(share));
      exchange.read(Exchange::kMessageWait);
    });
  }
  void on_half_close(Exchange& exchange) override {
    exchange.post(Lane::heavy, [this, &exchange] { complete(exchange); });
  }

 protected:
  /// `share`: of the request, to be kept with what is kept of it.
  virtual void add(Exchange& exchange, Request& request, MemoryShare share) = 0;
  virtual void complete(Exchange& exchange) = 0;
};

template <class Request, class Reply>
Method unary(Role role, Lane lane, typename Unary<Request, Reply>::Body body,
             typename Unary<Request, Reply>::AtOnce at_once = {}) {
  return {role, false, Counted::call,
          [=] { return std::make_unique<Unary<Request, Reply>>(lane, body, at_once); }};
}

template <class Request, class Reply>
Method series(Role role, Lane lane, typename Series<Request, Reply>::Body body) {
  return {role, false, Counted::stream,
          [lane, body] { return std::make_unique<Series<Request, Reply>>(lane, body); }};
}

/// A method whose handler is made by `make`.
template <class Make>
Method stream(Role role, Make make) {
  return {role, false, Counted::stream, std::move(make)};
}

}  // namespace mbcosim::server
