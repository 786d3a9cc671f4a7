/// Internal to the client library: what the server sends until somebody ends it.
#pragma once

#include <memory>
#include <string>
#include <utility>

#include "client/connection.h"
#include "client/deadline.h"

namespace mbcosim::client {

/// A stream of `Message` from `Service`. One thread reads, any cancels.
template <class Service, class Message>
class Reading {
 public:
  /// `open(stub, context)` makes the call.
  template <class Open>
  Reading(std::shared_ptr<Server::Impl> connection, const std::string& simulation, Open open)
      : server_(std::move(connection)),
        service_(Service::NewStub(server_->channel)),
        context_(*server_, kEndless, simulation),
        stream_(open(*service_, &context_)) {}
  Reading(const Reading&) = delete;
  Reading& operator=(const Reading&) = delete;
  ~Reading() {
    cancel();
    finish();
  }

  void cancel() { context_.TryCancel(); }
  /// The first message: the server's word that nothing is missed from now on. Throws Error; `what`
  /// is awaited.
  void begin(Message* first, double timeout, const char* what) {
    const Deadline deadline(timeout, [this] { cancel(); });
    if (stream_->Read(first)) return;
    const grpc::Status status = finish();
    if (deadline.is_over()) throw_late(what, timeout);
    require(status);
    throw Error(std::string(what) + ": the stream has ended",
                static_cast<int>(grpc::StatusCode::UNAVAILABLE), "", {});
  }
  /// False: the end. Throws Error when the server has ended it with one.
  bool next(Message* message) {
    if (!finished_ && stream_->Read(message)) return true;
    require(finish());
    return false;
  }

 private:
  /// OK also when the reader himself has ended it.
  grpc::Status finish() {
    if (finished_) return grpc::Status::OK;
    finished_ = true;
    const grpc::Status status = stream_->Finish();
    return status.error_code() == grpc::StatusCode::CANCELLED ? grpc::Status::OK : status;
  }

  std::shared_ptr<Server::Impl> server_;
  std::unique_ptr<typename Service::Stub> service_;
  CallContext context_;
  std::unique_ptr<grpc::ClientReader<Message>> stream_;
  bool finished_ = false;
};

}  // namespace mbcosim::client
