/// Version and features of the service's protocol: what `hello`, `GetServerInfo` and records name.
#pragma once

#include <string>

#include "mbcosim/v1/common.pb.h"

namespace mbcosim::server {

/// Version 1 was spoken before the contract was settled.
constexpr int kProtocolVersion = 2;

/// Additions to this version, by name; the newest last.
constexpr const char* kFeatures[] = {"grants",           "geometry", "symbols",      "step_sizes",
                                     "request_ids",      "pages",    "reset",        "results",
                                     "tables",           "events",   "checkpoints",  "pace",
                                     "sample_intervals", "journal",  "deck_sockets", "units",
                                     "following_loads"};

inline void fill_protocol(v1::VersionRange* out) {
  out->set_lowest(kProtocolVersion);
  out->set_highest(kProtocolVersion);
  out->clear_features();
  for (const char* feature : kFeatures) out->add_features(feature);
}

/// A client that says nothing speaks any version.
inline bool is_any(const v1::VersionRange& theirs) {
  return theirs.lowest() == 0 && theirs.highest() == 0;
}

constexpr const char* kNoRange =
    "`protocol` must have a `lowest` of at least 1 and a `highest` not below it";
inline bool is_range(const v1::VersionRange& theirs) {
  return is_any(theirs) || (theirs.lowest() >= 1 && theirs.lowest() <= theirs.highest());
}

inline bool includes_ours(const v1::VersionRange& theirs) {
  return is_any(theirs) ||
         (theirs.lowest() <= kProtocolVersion && kProtocolVersion <= theirs.highest());
}

/// What is wrong with versions that do not meet.
inline std::string version_mismatch(const v1::VersionRange& theirs) {
  const bool older = theirs.highest() < kProtocolVersion;
  return "the server speaks protocol version " + std::to_string(kProtocolVersion) +
         ", the client " + std::to_string(theirs.lowest()) + " to " +
         std::to_string(theirs.highest()) + ": take a newer " + (older ? "client" : "server");
}

}  // namespace mbcosim::server
