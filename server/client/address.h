/// Addresses of servers, as people give them.
#pragma once

#include <string>

namespace mbcosim::client {

/// "unix:PATH", "HOST:PORT", or another form that gRPC knows. Throws Error with reason
/// BAD_ARGUMENT and what is wrong, when it can be none.
void check_address(const std::string& address);

/// Why no server answers at a socket: "there is no such socket". Empty where that cannot be told.
std::string why_nobody(const std::string& address);

}  // namespace mbcosim::client
