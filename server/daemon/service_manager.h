/// What systemd wants to know of a daemon (Type=notify-reload).
#pragma once

#include <string>

namespace mbcosim::server {

/// Sends one state as in sd_notify(3), "READY=1" say, to the socket that $NOTIFY_SOCKET names;
/// without one nothing. The protocol is stable and meant to be spoken without a library.
void tell_service_manager(const std::string& state);

/// "RELOADING=1" with the clock that goes with it.
void tell_reloading();

}  // namespace mbcosim::server
