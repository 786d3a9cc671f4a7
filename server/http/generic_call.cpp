#include "http/generic_call.h"

#include <grpc/support/time.h>

#include "rpc/methods.h"
#include "threads/alertness.h"

namespace mbcosim::server::http {
namespace {

constexpr std::chrono::milliseconds kHangUpLook{200};  // how soon a client that hung up is noticed

thread_local Alertness for_reply;  ///< of this thread

void* tag() {  // one operation at a time: any tag will do
  static char mark;
  return &mark;
}

grpc::ByteBuffer buffer_of(std::string_view bytes) {
  const grpc::Slice slice(bytes.data(), bytes.size());
  return {&slice, 1};
}

}  // namespace

GenericCall::GenericCall(const std::shared_ptr<grpc::Channel>& channel, std::string path,
                         const Metadata& metadata, std::optional<std::chrono::milliseconds> timeout,
                         std::function<bool()> gone)
    : path_(std::move(path)), gone_(std::move(gone)), stub_(channel) {
  for (const auto& [name, value] : metadata) context_.AddMetadata(name, value);
  if (timeout) context_.set_deadline(std::chrono::system_clock::now() + *timeout);
}

GenericCall::~GenericCall() {
  context_.TryCancel();
  queue_.Shutdown();
  void* tag = nullptr;
  bool ok = false;
  while (queue_.Next(&tag, &ok)) {
  }
}

bool GenericCall::done() {
  using Status = grpc::CompletionQueue::NextStatus;
  void* tag = nullptr;
  bool ok = false;
  Status status = Status::TIMEOUT;
  const auto comes_by = [&](const auto& deadline) {
    status = queue_.AsyncNext(&tag, &ok, deadline);
    return status != Status::TIMEOUT;
  };
  for_reply.wait([&] { return comes_by(gpr_time_0(GPR_CLOCK_MONOTONIC)); },
                 [&] {
                   while (!comes_by(std::chrono::system_clock::now() + kHangUpLook))
                     if (gone_()) context_.TryCancel();
                   return true;
                 });
  return status == Status::GOT_EVENT && ok;
}

GenericCall::Answer GenericCall::ask(std::string_view request) {
  Answer answer;
  grpc::ByteBuffer reply;
  const auto call = stub_.PrepareUnaryCall(&context_, path_, buffer_of(request), &queue_);
  call->StartCall();
  call->Finish(&reply, &answer.status, tag());
  done();
  if (answer.status.ok()) answer.reply = joined(reply);
  return answer;
}

void GenericCall::start(std::string_view request) {
  stream_ = stub_.PrepareCall(&context_, path_, &queue_);
  stream_->StartCall(tag());
  done();
  stream_->WriteLast(buffer_of(request), grpc::WriteOptions(), tag());
  done();
}

std::optional<std::string> GenericCall::receive() {
  grpc::ByteBuffer reply;
  stream_->Read(&reply, tag());
  if (!done()) return std::nullopt;
  return joined(reply);
}

grpc::Status GenericCall::finish() {
  grpc::Status status;
  stream_->Finish(&status, tag());
  done();
  return status;
}

}  // namespace mbcosim::server::http
