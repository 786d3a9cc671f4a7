/// mbcosimd: serves simulations over gRPC until SIGTERM or SIGINT.
#include <absl/synchronization/mutex.h>
#include <malloc.h>
#include <signal.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <exception>
#include <thread>

#include "daemon/daemon.h"
#include "daemon/logging.h"
#include "daemon/options.h"
#include "daemon/service_manager.h"
#include "files/default_socket.h"
#include "host/control_group.h"

namespace {

using namespace mbcosim::server;

/// Blocked before any thread starts, so that only this thread sees them.
sigset_t blocked_signals() {
  sigset_t signals;
  sigemptyset(&signals);
  for (const int number : {SIGTERM, SIGINT, SIGHUP}) sigaddset(&signals, number);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  return signals;
}

/// Until SIGTERM or SIGINT. What has changed in files is taken on SIGHUP, and within a second.
void serve(Daemon& daemon, const sigset_t& signals) {
  constexpr timespec kLook{1, 0};
  for (;;) {
    const int number = sigtimedwait(&signals, nullptr, &kLook);
    if (number == SIGTERM || number == SIGINT) return;
    if (number == SIGHUP) tell_reloading();
    daemon.reload(number == SIGHUP);
    if (number == SIGHUP) tell_service_manager("READY=1");
  }
}

/// So long, or until another SIGTERM or SIGINT.
void wait_for_end(const sigset_t& signals, std::chrono::seconds time) {
  const auto end = std::chrono::steady_clock::now() + time;
  for (;;) {
    const auto left = std::chrono::duration_cast<std::chrono::nanoseconds>(
        end - std::chrono::steady_clock::now());
    if (left.count() <= 0) return;
    const timespec wait{left.count() / 1000000000, left.count() % 1000000000};
    const int number = sigtimedwait(&signals, nullptr, &wait);
    if (number == SIGTERM || number == SIGINT) return;
  }
}

}  // namespace

int main(int argc, char** argv) {
  const Invocation invocation = read_options(argc, argv);
  if (invocation.exit_code) return *invocation.exit_code;
  if (!invocation.check.address.empty()) return check_health(invocation.check);

  // glibc's eight arenas a core keep what was freed in each: a daemon whose simulations come and go
  // would take a multiple of what it uses.
  mallopt(M_ARENA_MAX, std::max(2, mbcosim::server::usable_cores()));

  // Debian's absl is built with assertions: it would put each lock of gRPC into a graph of all
  // locks, under one more lock that all threads share.
  absl::SetMutexDeadlockDetectionMode(absl::OnDeadlockCycle::kIgnore);

  signal(SIGXFSZ, SIG_IGN);  // a file that must not grow is an error of the write
  signal(SIGPIPE, SIG_IGN);  // so is a reader of the log that has gone

  const sigset_t signals = blocked_signals();
  try {
    start_logging(invocation.config);
    for (const std::string& address : invocation.config.listen) make_default_folder(address);
    Daemon daemon(invocation.config);
    tell_service_manager("READY=1");
    serve(daemon, signals);
    tell_service_manager("STOPPING=1");
    if (daemon.drain()) wait_for_end(signals, invocation.config.drain);
    if (!daemon.shut_down()) {
      spdlog::shutdown();
      std::_Exit(0);
    }
  } catch (const std::exception& error) {
    std::fprintf(stderr, "mbcosimd: error: %s\n", error.what());
    return 4;
  }
  return 0;
}
