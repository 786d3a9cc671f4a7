#include "cli/lsp/wire.h"

#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <stdexcept>

namespace mbcosim::lsp {
namespace {

constexpr std::size_t kLargest = 64u << 20, kLargestHeader = 4096;
constexpr int kDeepest = 200;       ///< nesting of a message
constexpr std::size_t kEscape = 6;  ///< characters of \uXXXX

/// The length that a header announces.
std::size_t length_of(std::string_view header) {
  constexpr std::string_view kName = "Content-Length:";
  std::size_t at = header.find(kName);
  if (at == std::string_view::npos) throw std::runtime_error("a message without Content-Length");
  at += kName.size();
  while (at < header.size() && header[at] == ' ') ++at;
  std::size_t length = 0;
  const auto [end, code] =
      std::from_chars(header.data() + at, header.data() + header.size(), length);
  if (code != std::errc() || length > kLargest)
    throw std::runtime_error("a message of a length that is not served");
  return length;
}

/// The deepest nesting of brackets outside of strings.
int nesting_of(std::string_view text) {
  int depth = 0, deepest = 0;
  bool quoted = false;
  for (std::size_t k = 0; k < text.size(); ++k) {
    const char c = text[k];
    if (c == '"')
      quoted = !quoted;
    else if (quoted && c == '\\')
      ++k;
    else if (!quoted && (c == '[' || c == '{'))
      deepest = std::max(deepest, ++depth);
    else if (!quoted && (c == ']' || c == '}'))
      --depth;
  }
  return deepest;
}

/// The code unit of the escape \uXXXX at `at`; negative: there is none.
int unit_at(std::string_view text, std::size_t at) {
  if (at + kEscape > text.size() || text[at] != '\\' || text[at + 1] != 'u') return -1;
  int unit = 0;
  const char *const first = text.data() + at + 2, *const last = text.data() + at + kEscape;
  const auto [end, code] = std::from_chars(first, last, unit, 16);
  return code == std::errc() && end == last ? unit : -1;
}

void mend_surrogates(std::string& text) {
  const auto is_high = [](int unit) { return unit >= 0xD800 && unit < 0xDC00; };
  const auto is_low = [](int unit) { return unit >= 0xDC00 && unit < 0xE000; };
  for (std::size_t at = text.find('\\'); at != std::string::npos;) {
    const int unit = unit_at(text, at);
    if (is_high(unit) && is_low(unit_at(text, at + kEscape))) {
      at = text.find('\\', at + 2 * kEscape);
      continue;
    }
    if (is_high(unit) || is_low(unit)) text.replace(at + 2, 4, "fffd");
    at = text.find('\\', at + 2);
  }
}

}  // namespace

bool Wire::fill() {
  std::array<char, 65536> piece;
  ssize_t count = 0;
  do count = ::read(in_, piece.data(), piece.size());
  while (count < 0 && errno == EINTR);
  if (count <= 0) return false;
  buffer_.append(piece.data(), static_cast<std::size_t>(count));
  return true;
}

std::optional<Json> Wire::read() {
  constexpr std::string_view kEnd = "\r\n\r\n";
  std::size_t end = 0;
  while ((end = buffer_.find(kEnd)) == std::string::npos) {
    if (buffer_.size() > kLargestHeader) throw std::runtime_error("a header that does not end");
    if (!fill()) return std::nullopt;
  }
  const std::size_t length = length_of(std::string_view(buffer_).substr(0, end)),
                    start = end + kEnd.size();
  while (buffer_.size() < start + length)
    if (!fill()) return std::nullopt;
  std::string text = buffer_.substr(start, length);
  buffer_.erase(0, start + length);
  if (nesting_of(text) > kDeepest) return Json(Json::value_t::discarded);
  mend_surrogates(text);
  return Json::parse(text, nullptr, /*allow_exceptions=*/false);
}

bool Wire::waiting() const {
  if (!buffer_.empty()) return true;
  pollfd state{in_, POLLIN, 0};
  return ::poll(&state, 1, 0) > 0;
}

void Wire::write(const Json& message) {
  const std::string body = message.dump(-1, ' ', false, Json::error_handler_t::replace);
  const std::string text = "Content-Length: " + std::to_string(body.size()) + "\r\n\r\n" + body;
  for (std::size_t done = 0; done < text.size();) {
    const ssize_t count = ::write(out_, text.data() + done, text.size() - done);
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) throw std::runtime_error("the editor is gone");
    done += static_cast<std::size_t>(count);
  }
}

}  // namespace mbcosim::lsp
