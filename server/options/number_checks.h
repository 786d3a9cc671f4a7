/// Checks of options that take a number, with texts for people: CLI11's own have all digits of the
/// largest double.
#pragma once

#include <charconv>
#include <cstdio>
#include <limits>
#include <string>

namespace mbcosim::server {

/// A check for CLI::Option::check: what is wrong with the text, or nothing.
class NumberCheck {
 public:
  /// "at least 0"
  static NumberCheck at_least(double least) { return {least, kLargest, false}; }
  /// "above 0"
  static NumberCheck above(double bound) { return {bound, kLargest, true}; }
  /// "that is finite"
  static NumberCheck finite() { return {-kLargest, kLargest, false}; }
  /// "from 1 to 1024"
  static NumberCheck within(double least, double most) { return {least, most, false}; }

  std::string operator()(const std::string& text) const {
    double value = 0;
    const char* const end = text.data() + text.size();
    const auto [stop, error] = std::from_chars(text.data(), end, value);
    const bool read = error == std::errc() && stop == end;
    if (read && value <= most_ && (is_open_ ? value > least_ : value >= least_)) return "";
    return "expected a number " + wanted() + ", got \"" + text + "\"";
  }

 private:
  static constexpr double kLargest = std::numeric_limits<double>::max();
  NumberCheck(double least, double most, bool is_open)
      : least_(least), most_(most), is_open_(is_open) {}

  std::string wanted() const {
    if (least_ == -kLargest) return "that is finite";
    if (most_ < kLargest) return "from " + number(least_) + " to " + number(most_);
    return (is_open_ ? "above " : "of at least ") + number(least_);
  }
  static std::string number(double value) {
    char text[32];
    std::snprintf(text, sizeof text, "%.15g", value);
    return text;
  }

  double least_, most_;
  bool is_open_;  ///< the bound itself is refused
};

}  // namespace mbcosim::server
