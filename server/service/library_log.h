/// What the libraries of the daemon have to say.
#pragma once

#include <spdlog/common.h>

#include <string_view>

#include "service/event_log.h"

namespace mbcosim::server {

/// Lines of one library in the daemon's log. Clients make libraries talk: no more than so many
/// lines a second pass, none is long, and control characters are lost. Thread-safe.
class LibraryLog {
 public:
  /// `name` begins each line.
  explicit LibraryLog(const char* name) : name_(name) {}
  void tell(spdlog::level::level_enum level, std::string_view text);

 private:
  const char* const name_;
  Rate rate_{20};
};

}  // namespace mbcosim::server
