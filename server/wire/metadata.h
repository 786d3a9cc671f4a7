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

constexpr std::string_view kBearer = "Bearer ";  ///< begins an authorization by a token

/// Does it, in whatever case (RFC 9110, 11.1)?
inline bool is_bearer(std::string_view authorization) {
  const auto lower = [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c; };
  return authorization.size() >= kBearer.size() &&
         std::equal(kBearer.begin(), kBearer.end(), authorization.begin(),
                    [&](char a, char b) { return lower(a) == lower(b); });
}

}  // namespace mbcosim::server
