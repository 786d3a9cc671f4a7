/// A call of any method, by its path and with messages as bytes, answered by the gRPC server of
/// this process.
#pragma once

#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace mbcosim::server::http {

class GenericCall {
 public:
  using Metadata = std::vector<std::pair<std::string, std::string>>;

  /// `gone` tells whether the caller has lost interest; the call is then cancelled. `path` is
  /// "/mbcosim.v1.Simulations/Step".
  GenericCall(const std::shared_ptr<grpc::Channel>& channel, std::string path,
              const Metadata& metadata, std::optional<std::chrono::milliseconds> timeout,
              std::function<bool()> gone);
  ~GenericCall();
  GenericCall(const GenericCall&) = delete;
  GenericCall& operator=(const GenericCall&) = delete;

  struct Answer {
    grpc::Status status;
    std::string reply;  ///< if the status is good
  };
  /// Of a method with one request and one reply, the whole call.
  Answer ask(std::string_view request);

  /// Begins the call of a method with one request and a stream of replies.
  void start(std::string_view request);
  /// The next reply; no value: there is none, `finish` tells why.
  std::optional<std::string> receive();
  grpc::Status finish();
  void cancel() { context_.TryCancel(); }

 private:
  /// Waits for the operation just started.
  bool done();

  const std::string path_;
  grpc::ClientContext context_;
  grpc::CompletionQueue queue_;
  std::function<bool()> gone_;
  grpc::GenericStub stub_;
  std::unique_ptr<grpc::GenericClientAsyncReaderWriter> stream_;
};

}  // namespace mbcosim::server::http
