/// The first frame of every thread of the daemon: what is thrown ends there, not the process.
#pragma once

#include <functional>

namespace mbcosim::server {

/// Calls `body`; what it throws is logged under the thread's name.
void run_caught(const char* thread, const std::function<void()>& body) noexcept;

}  // namespace mbcosim::server
