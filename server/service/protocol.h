/// Versions of the protocol that the server speaks.
#pragma once

#include <string>

#include "mbcosim/v1/common.pb.h"
#include "wire/protocol.h"
#include "wire/refusal.h"

namespace mbcosim::server {

/// Throws VERSION_MISMATCH unless the client speaks a version of the server's.
inline void check_protocol(const v1::VersionRange& range) {
  if (!is_range(range)) throw Refusal(v1::REASON_BAD_ARGUMENT, kNoRange);
  if (includes_ours(range)) return;
  const std::string version = std::to_string(kProtocolVersion);
  throw Refusal(v1::REASON_VERSION_MISMATCH, version_mismatch(range),
                {{"lowest", version}, {"highest", version}});
}

}  // namespace mbcosim::server
