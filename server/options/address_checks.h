/// Checks of options that name where something listens.
#pragma once

#include <charconv>
#include <string>
#include <string_view>

namespace mbcosim::server {

/// Is it HOST:PORT, with a port from `least` to 65535?
inline bool is_host_and_port(std::string_view text, int least = 0) {
  const std::size_t colon = text.rfind(':');
  if (colon == std::string_view::npos || colon == 0) return false;
  const std::string_view digits = text.substr(colon + 1);
  int port = -1;
  const auto [stop, error] = std::from_chars(digits.data(), digits.data() + digits.size(), port);
  return error == std::errc() && stop == digits.data() + digits.size() && port >= least &&
         port <= 65535;
}

/// A check for CLI::Option::check: what is wrong with the text, or nothing. Port 0: any.
class AddressCheck {
 public:
  /// For HTTP: the library that serves it, as Debian builds it, knows no IPv6.
  static AddressCheck of_host() { return AddressCheck(false); }
  static AddressCheck of_host_or_file() { return AddressCheck(true); }

  std::string operator()(const std::string& text) const {
    const bool is_file = text.compare(0, kUnix.size(), kUnix) == 0;
    if (!may_be_file_ && text.compare(0, 1, "[") == 0)
      return "HTTP is served at addresses of IPv4 only, got \"" + text + "\"";
    if (is_file && names_several(text))
      return "several addresses in one, \"" + text +
             "\": give the option for each, or [FIRST,SECOND] in the environment";
    if (is_file ? may_be_file_ && text.size() > kUnix.size() : is_host_and_port(text)) return "";
    return std::string("expected ") + (may_be_file_ ? "unix:PATH or " : "") +
           "HOST:PORT with a port from 0 to 65535, got \"" + text + "\"";
  }

 private:
  /// Behind a blank or a comma, of which a path may have some, too.
  static bool names_several(std::string_view text) {
    const std::string_view last = text.substr(text.find_last_of(" ,") + 1);
    return last.size() < text.size() && (last.starts_with(kUnix) || is_host_and_port(last));
  }
  static constexpr std::string_view kUnix = "unix:";

  explicit AddressCheck(bool may_be_file) : may_be_file_(may_be_file) {}
  bool may_be_file_;
};

}  // namespace mbcosim::server
