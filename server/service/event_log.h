/// What operators see of calls and peers: one line each, and no flood of them.
#pragma once

#include <cstdint>
#include <string>

#include "threads/mutex.h"
#include "wire/refusal.h"

namespace mbcosim::server {

/// Lets so many pass in a second, and counts what it held back. Thread-safe.
class Rate {
 public:
  using Clock = std::chrono::steady_clock;
  explicit Rate(int per_second) : per_second_(per_second) {}
  /// False: this one is held back. `missed`: those held back before it.
  bool pass(Clock::time_point now, std::int64_t* missed) TS_EXCLUDES(mutex_);

 private:
  const int per_second_;
  Mutex mutex_;
  Clock::time_point second_ TS_GUARDED_BY(mutex_){};
  int passed_ TS_GUARDED_BY(mutex_) = 0;
  std::int64_t missed_ TS_GUARDED_BY(mutex_) = 0;
};

/// Thread-safe. Texts of clients lose their control characters.
class EventLog {
 public:
  void refused(const std::string& method, const std::string& identity, const Refusal& refusal);
  void attached(const std::string& simulation, const std::string& port,
                const std::string& identity);
  void detached(const std::string& simulation, const std::string& port,
                const std::string& identity);
  void step_failed(const std::string& simulation, std::int64_t step, const std::string& why);

 private:
  void write(Rate& rate, const std::string& text);
  Rate refusals_{20}, peers_{50}, failures_{20};
};

/// The text with '?' in place of control characters.
std::string printable(std::string text);

}  // namespace mbcosim::server
