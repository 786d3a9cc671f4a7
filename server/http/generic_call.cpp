#include "http/generic_call.h"

namespace mbcosim::server::http {
namespace {

constexpr std::chrono::milliseconds kHangUpLook{200};  // how soon a client that hung up is noticed

void* tag() {  // one operation at a time: any tag will do
  static char mark;
  return &mark;
}

}  // namespace

GenericCall::GenericCall(const std::shared_ptr<grpc::Channel>& channel, const std::string& path,
                         const Metadata& metadata, std::optional<std::chrono::milliseconds> timeout,
                         std::function<bool()> gone)
    : gone_(std::move(gone)), stub_(channel) {
  for (const auto& [name, value] : metadata) context_.AddMetadata(name, value);
  if (timeout) context_.set_deadline(std::chrono::system_clock::now() + *timeout);
  stream_ = stub_.PrepareCall(&context_, path, &queue_);
  stream_->StartCall(tag());
  done();
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
  void* tag = nullptr;
  bool ok = false;
  for (;;) {
    const auto status = queue_.AsyncNext(&tag, &ok, std::chrono::system_clock::now() + kHangUpLook);
    if (status == grpc::CompletionQueue::GOT_EVENT) return ok;
    if (status == grpc::CompletionQueue::SHUTDOWN) return false;
    if (gone_()) context_.TryCancel();
  }
}

void GenericCall::send(std::string_view request) {
  const grpc::Slice slice(request.data(), request.size());
  stream_->WriteLast(grpc::ByteBuffer(&slice, 1), grpc::WriteOptions(), tag());
  done();
}

std::optional<std::string> GenericCall::receive() {
  grpc::ByteBuffer reply;
  stream_->Read(&reply, tag());
  if (!done()) return std::nullopt;
  std::vector<grpc::Slice> slices;
  if (!reply.Dump(&slices).ok()) return std::nullopt;
  std::string bytes;
  bytes.reserve(reply.Length());
  for (const grpc::Slice& slice : slices)
    bytes.append(reinterpret_cast<const char*>(slice.begin()), slice.size());
  return bytes;
}

grpc::Status GenericCall::finish() {
  grpc::Status status;
  stream_->Finish(&status, tag());
  done();
  return status;
}

}  // namespace mbcosim::server::http
