#include "rpc/methods.h"

#include <vector>

namespace mbcosim::server {

std::string joined(const grpc::ByteBuffer& bytes) {
  std::vector<grpc::Slice> slices;
  if (!bytes.Dump(&slices).ok())
    throw Refusal(v1::REASON_BAD_ARGUMENT, "the message cannot be decompressed");
  std::string text;
  text.reserve(bytes.Length());
  for (const grpc::Slice& slice : slices)
    text.append(reinterpret_cast<const char*>(slice.begin()), slice.size());
  return text;
}

}  // namespace mbcosim::server
