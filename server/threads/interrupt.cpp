#include "threads/interrupt.h"

#include <atomic>

namespace mbcosim {
namespace {

std::atomic<CancelToken*> active_token{nullptr};  // what a signal handler can reach

void handle_signal(int) {
  if (CancelToken* token = active_token.load()) token->cancel();
}

}  // namespace

InterruptGuard::InterruptGuard() {
  active_token.store(&token_);
  struct sigaction action {};
  action.sa_handler = handle_signal;
  action.sa_flags = static_cast<int>(SA_RESETHAND);  // a second signal ends the process at once
  ::sigaction(SIGINT, &action, &old_interrupt_);
  ::sigaction(SIGTERM, &action, &old_terminate_);
  ::sigaction(SIGHUP, nullptr, &old_hang_up_);
  if (old_hang_up_.sa_handler != SIG_IGN) ::sigaction(SIGHUP, &action, nullptr);  // nohup
}

InterruptGuard::~InterruptGuard() {
  ::sigaction(SIGINT, &old_interrupt_, nullptr);
  ::sigaction(SIGTERM, &old_terminate_, nullptr);
  ::sigaction(SIGHUP, &old_hang_up_, nullptr);
  active_token.store(nullptr);
}

}  // namespace mbcosim
