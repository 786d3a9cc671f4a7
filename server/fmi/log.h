/// Messages of an instance to its importer, by categories that can be switched.
#pragma once

#include <array>
#include <atomic>
#include <functional>
#include <span>
#include <string>

#include "fmi/status.h"

namespace mbcosim::fmi {

struct LogCategory {
  const char* name;
  const char* description;
};

/// As modelDescription.xml lists them. Status k has its messages in category k − 1; the first holds
/// what is no failure.
inline constexpr std::array<LogCategory, 5> kLogCategories = {
    {{"logEvents", "what the instance does: models read, simulations started, states restored"},
     {"logStatusWarning", "warnings of the deck"},
     {"logStatusDiscard",
      "steps that did not converge or in which the deck ended, and values that were refused"},
     {"logStatusError", "calls that failed"},
     {"logStatusFatal", "failures after which no call is allowed"}}};

class Log {
 public:
  using Sink = std::function<void(Status, const char* category, const char* message)>;
  Log(Sink sink, bool on) : sink_(std::move(sink)), enabled_(on ? kAll : 0) {}
  Log(const Log& other) : sink_(other.sink_), enabled_(other.enabled_.load()) {}

  /// `#` starts a value reference in messages of FMI; here it is text and is doubled.
  void write(Status status, const std::string& message) const;
  void switch_all(bool on) { enabled_ = on ? kAll : 0; }
  /// False: there is no such category.
  bool switch_one(const std::string& category, bool on);

 private:
  static constexpr unsigned kAll = (1u << kLogCategories.size()) - 1;

  Sink sink_;  ///< may be empty
  /// A bit a category; atomic, for a call that is refused writes while another may switch.
  std::atomic<unsigned> enabled_;
};

}  // namespace mbcosim::fmi
