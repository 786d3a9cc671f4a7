#include "rpc/resets.h"

namespace mbcosim::server {

bool Resets::are_too_many(const std::string& connection, Clock::time_point now) {
  constexpr std::chrono::seconds kSecond(1);
  Guard guard(mutex_);
  if (now - forgot_ >= kSecond) forget_before(now - kSecond);
  Count& count = counts_.try_emplace(connection, Count{now}).first->second;
  if (now - count.second >= kSecond) count = {now};
  return ++count.resets % kMost == 0;
}

void Resets::forget_before(Clock::time_point second) {
  forgot_ = second + std::chrono::seconds(1);
  for (auto each = counts_.begin(); each != counts_.end();)
    each = each->second.second <= second ? counts_.erase(each) : std::next(each);
}

}  // namespace mbcosim::server
