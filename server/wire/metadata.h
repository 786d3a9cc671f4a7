/// What calls carry beside their messages.
#pragma once

#include <algorithm>
#include <string_view>

namespace mbcosim::server {

/// May gRPC carry the value? Others abort the process that gives them to gRPC
/// (`GRPC_CALL_ERROR_INVALID_METADATA`).
inline bool is_metadata(std::string_view value) {
  return std::all_of(value.begin(), value.end(), [](char c) { return c >= ' ' && c <= '~'; });
}

}  // namespace mbcosim::server
