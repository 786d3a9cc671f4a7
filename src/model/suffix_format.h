/// A number format of the shape TEXT%[0][WIDTH|*]dTEXT, as in C, without C's dangers.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace mbcosim {

struct SuffixFormat {
  std::string before, after;
  bool zeros = false;
  int width = -1;  ///< -1: `*`, given by the caller

  /// Nothing when the text is not of that shape.
  static std::optional<SuffixFormat> parse(std::string_view text) {
    SuffixFormat f;
    const std::size_t percent = text.find('%');
    if (percent == text.npos) return std::nullopt;
    f.before = text.substr(0, percent);
    std::size_t k = percent + 1;
    if (k < text.size() && text[k] == '0') f.zeros = true, ++k;
    if (k < text.size() && text[k] == '*') {
      ++k;
    } else {
      for (f.width = 0; k < text.size() && text[k] >= '0' && text[k] <= '9' && f.width < 100; ++k)
        f.width = 10 * f.width + (text[k] - '0');
    }
    if (k >= text.size() || (text[k] != 'd' && text[k] != 'i') || f.width > 99) return std::nullopt;
    f.after = text.substr(k + 1);
    const bool plain = (f.before + f.after).find_first_of("%/\\") == std::string::npos;
    return plain ? std::optional(f) : std::nullopt;
  }
  std::string text(int number, int given_width) const {
    std::string digits = std::to_string(number);
    const std::size_t wanted = static_cast<std::size_t>(width >= 0 ? width : given_width);
    if (digits.size() < wanted) digits.insert(0, wanted - digits.size(), zeros ? '0' : ' ');
    return before + digits + after;
  }
};

}  // namespace mbcosim
