#include "service/library_log.h"

#include <spdlog/spdlog.h>

#include <string>

namespace mbcosim::server {

void LibraryLog::tell(spdlog::level::level_enum level, std::string_view text) {
  constexpr std::size_t kLongest = 500;
  if (!spdlog::should_log(level)) return;  // what nobody sees holds nothing back
  std::int64_t missed = 0;
  if (!rate_.pass(Rate::Clock::now(), &missed)) return;
  const std::string left_out =
      missed > 0 ? " (and " + std::to_string(missed) + " lines before it were left out)" : "";
  spdlog::log(level, "{}: {}{}", name_, printable(std::string(text.substr(0, kLongest))), left_out);
}

}  // namespace mbcosim::server
