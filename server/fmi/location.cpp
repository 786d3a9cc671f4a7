#include "fmi/location.h"

#include <algorithm>
#include <charconv>

namespace mbcosim::fmi {

std::optional<std::string> folder_of(std::string_view location) {
  constexpr std::string_view kScheme = "file:";
  if (!location.starts_with(kScheme)) return std::string(location);
  location.remove_prefix(kScheme.size());
  if (location.starts_with("//"))
    location.remove_prefix(std::min(location.find('/', 2), location.size()));
  std::string path;
  while (!location.empty()) {
    const bool escaped = location.front() == '%';
    unsigned char code = static_cast<unsigned char>(location.front());
    if (escaped) {
      const std::string_view digits = location.substr(1, 2);
      const char* end = digits.data() + digits.size();
      if (digits.size() < 2 || std::from_chars(digits.data(), end, code, 16).ptr != end)
        return std::nullopt;
    }
    path += static_cast<char>(code);
    location.remove_prefix(escaped ? 3 : 1);
  }
  return path;
}

std::string uri_of(std::string_view folder) {
  constexpr std::string_view kPlain =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-._~/";
  constexpr char kDigits[] = "0123456789ABCDEF";
  std::string uri = "file://";
  for (const char c : folder) {
    const auto code = static_cast<unsigned char>(c);
    if (kPlain.find(c) != std::string_view::npos)
      uri += c;
    else
      uri += {'%', kDigits[code >> 4], kDigits[code & 15]};
  }
  return uri;
}

}  // namespace mbcosim::fmi
