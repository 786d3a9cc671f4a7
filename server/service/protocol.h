/// Versions of the protocol that the server speaks.
#pragma once

#include <string>

#include "mbcosim/v1/common.pb.h"
#include "wire/protocol.h"
#include "wire/refusal.h"

namespace mbcosim::server {

/// Throws VERSION_MISMATCH unless the client speaks a version of the server's.
inline void check_protocol(const v1::VersionRange& range) {
  if (range.lowest() == 0 && range.highest() == 0) return;
  if (range.lowest() < 1 || range.highest() < range.lowest())
    throw Refusal(v1::REASON_BAD_ARGUMENT,
                  "`protocol` must have a `lowest` of at least 1 and a `highest` not below it");
  if (range.lowest() <= kProtocolVersion && kProtocolVersion <= range.highest()) return;
  const std::string version = std::to_string(kProtocolVersion);
  throw Refusal(v1::REASON_VERSION_MISMATCH, version_mismatch(range),
                {{"lowest", version}, {"highest", version}});
}

}  // namespace mbcosim::server
