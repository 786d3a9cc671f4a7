#include "service/event_log.h"

#include <spdlog/spdlog.h>

#include <algorithm>

namespace mbcosim::server {

bool Rate::pass(Clock::time_point now, std::int64_t* missed) {
  Guard guard(mutex_);
  if (now - second_ >= std::chrono::seconds(1)) {
    second_ = now;
    passed_ = 0;
  }
  if (passed_ >= per_second_) {
    ++missed_;
    return false;
  }
  ++passed_;
  *missed = std::exchange(missed_, 0);
  return true;
}

std::string printable(std::string text) {
  std::replace_if(
      text.begin(), text.end(),
      [](char c) { return static_cast<unsigned char>(c) < 32 || c == 127; }, '?');
  return text;
}

void EventLog::write(Rate& rate, const std::string& text) {
  std::int64_t missed = 0;
  if (!rate.pass(Rate::Clock::now(), &missed)) return;
  if (missed > 0)
    spdlog::info("{} (and {} such lines before it were left out)", printable(text), missed);
  else
    spdlog::info("{}", printable(text));
}

void EventLog::refused(const std::string& method, const std::string& identity,
                       const Refusal& refusal) {
  write(refusals_, method + " refused to " + (identity.empty() ? "a caller not known" : identity) +
                       ": " + reason_name(refusal.reason()) + ": " + refusal.what());
}

void EventLog::attached(const std::string& simulation, const std::string& port,
                        const std::string& identity) {
  write(peers_, simulation + ": " + identity + " attached to port " + port);
}

void EventLog::detached(const std::string& simulation, const std::string& port,
                        const std::string& identity) {
  write(peers_, simulation + ": " + identity + " left port " + port);
}

void EventLog::step_failed(const std::string& simulation, std::int64_t step,
                           const std::string& why) {
  write(failures_, simulation + ": step " + std::to_string(step) + " failed: " + why);
}

}  // namespace mbcosim::server
