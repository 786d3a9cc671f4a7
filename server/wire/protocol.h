/// Version of the service's protocol: what `hello`, `GetServerInfo` and records name.
#pragma once

namespace mbcosim::server {

constexpr int kProtocolVersion = 1;

}  // namespace mbcosim::server
