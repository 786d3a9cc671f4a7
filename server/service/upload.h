/// Decks on their way in: bundles in pieces, or names under the model root.
#pragma once

#include <map>
#include <string>

#include "mbcosim/v1/simulations.grpc.pb.h"
#include "service/config.h"

namespace mbcosim::server {

struct Upload {
  v1::UploadHeader header;
  std::map<std::string, std::string> files;  ///< by name within the bundle
};

/// Files that arrive in pieces.
class Bundle {
 public:
  explicit Bundle(const ServiceLimits& limits) : limits_(limits) {}
  /// Appends a piece. Throws Refusal for a bad name or an exceeded limit.
  void add(const v1::FileChunk& chunk);
  std::map<std::string, std::string> take() { return std::move(files_); }

 private:
  const ServiceLimits& limits_;
  std::int64_t bytes_ = 0;
  std::map<std::string, std::string> files_;
};

/// Collects the messages of an upload. Throws Refusal.
Upload read_upload(grpc::ServerReader<v1::UploadRequest>* reader, const ServiceLimits& limits);

/// Reads the deck. Throws Refusal when the model root or the file in it is not to be had; a wrong
/// deck is in the report.
LoadReport load(const Upload& upload, const Config& config);
/// Ports that need equations of their own in the model.
std::vector<PortAttachment> attachments(const v1::CreateOptions& options);

}  // namespace mbcosim::server
