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

}  // namespace mbcosim::fmi
