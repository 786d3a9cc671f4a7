/// SIGINT and SIGTERM, for a program that ends in good order.
#pragma once

#include <atomic>
#include <csignal>

namespace mbcosim::peer {

/// While it lives a first signal only sets a flag; a second one ends the process at once.
class Interrupt {
 public:
  Interrupt() {
    struct sigaction action {};
    action.sa_handler = [](int) { seen_.store(true); };
    action.sa_flags = static_cast<int>(SA_RESETHAND);
    ::sigaction(SIGINT, &action, &old_interrupt_);
    ::sigaction(SIGTERM, &action, &old_terminate_);
  }
  ~Interrupt() {
    ::sigaction(SIGINT, &old_interrupt_, nullptr);
    ::sigaction(SIGTERM, &old_terminate_, nullptr);
  }
  Interrupt(const Interrupt&) = delete;
  Interrupt& operator=(const Interrupt&) = delete;
  static bool seen() { return seen_.load(); }

 private:
  static inline std::atomic<bool> seen_{false};  // what a signal handler can reach
  struct sigaction old_interrupt_, old_terminate_;
};

}  // namespace mbcosim::peer
