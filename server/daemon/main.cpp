/// mbcosimd: serves simulations over gRPC until SIGTERM or SIGINT.
#include <malloc.h>
#include <signal.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <thread>

#include "daemon/daemon.h"
#include "daemon/logging.h"
#include "daemon/options.h"

int main(int argc, char** argv) {
  using namespace mbcosim::server;
  const Invocation invocation = read_options(argc, argv);
  if (invocation.exit_code) return *invocation.exit_code;
  if (!invocation.check_address.empty()) return check_health(invocation.check_address);

  // glibc's eight arenas a core keep what was freed in each: a daemon whose simulations come and go
  // would take a multiple of what it uses.
  mallopt(M_ARENA_MAX, static_cast<int>(std::max(2u, std::thread::hardware_concurrency())));

  signal(SIGXFSZ, SIG_IGN);  // a file that must not grow is an error of the write

  sigset_t signals;  // blocked before any thread starts, so that only sigwait below sees them
  sigemptyset(&signals);
  sigaddset(&signals, SIGTERM);
  sigaddset(&signals, SIGINT);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  try {
    start_logging(invocation.config);
    Daemon daemon(invocation.config);
    int signal_number = 0;
    sigwait(&signals, &signal_number);
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
