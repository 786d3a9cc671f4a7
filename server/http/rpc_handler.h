/// Calls of the service over HTTP: the Connect protocol and gRPC-Web, for every method of the
/// descriptors that has one request.
#pragma once

#include <google/protobuf/descriptor.h>

#include <atomic>
#include <map>
#include <memory>
#include <string>

#include "http/codec.h"
#include "http/connection.h"
#include "http/generic_call.h"
#include "rpc/budgets.h"
#include "rpc/places.h"

namespace mbcosim::server::http {

/// How a request is framed, as its `Content-Type` says.
struct Framing {
  enum class Kind { unary, stream, grpc_web, grpc_web_text };
  Kind kind = Kind::unary;
  Encoding encoding = Encoding::json;
  bool enveloped() const { return kind != Kind::unary; }
  bool grpc() const { return kind == Kind::grpc_web || kind == Kind::grpc_web_text; }
};

/// No value: a type that no protocol here has.
std::optional<Framing> framing_of(std::string_view content_type);
std::string content_type_of(const Framing& framing);

class RpcHandler {
 public:
  struct Limits {
    std::size_t body_bytes;
    int streams_per_identity;
    int streams;  ///< of all identities
    int calls_per_identity;
    int calls;  ///< streams and others, of all identities
  };

  RpcHandler(std::shared_ptr<grpc::Channel> channel, MemoryBudgets& budgets, const Limits& limits)
      : channel_(std::move(channel)),
        budgets_(budgets),
        limits_(limits),
        streams_(limits.streams_per_identity, limits.streams),
        calls_(limits.calls_per_identity, limits.calls) {}

  /// The method that "/mbcosim.v1.Simulations/Step" names; null: none.
  static const google::protobuf::MethodDescriptor* find(std::string_view path);
  /// Serves a call of `identity`; `authorization` goes on to gRPC unless it is empty.
  void serve(Connection& connection, const google::protobuf::MethodDescriptor& method,
             const std::string& identity, const std::string& authorization);
  /// Ends all calls, now and from now on.
  void close() { closing_ = true; }

 private:
  struct Call;

  grpc::Status read_request(Call& call, std::string* request) const;
  grpc::Status read_counted(Call& call, std::string* request) const;
  static void answer_whole(Call& call, GenericCall& rpc, const std::string& request);
  static void answer_pieces(Call& call, GenericCall& rpc, const std::string& request);

  std::shared_ptr<grpc::Channel> channel_;
  MemoryBudgets& budgets_;
  const Limits limits_;
  std::atomic<bool> closing_{false};
  Places streams_, calls_;
};

}  // namespace mbcosim::server::http
