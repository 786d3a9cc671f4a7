#include "cli/lsp/wire.h"

#include <poll.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <charconv>
#include <stdexcept>

namespace mbcosim::lsp {
namespace {

constexpr std::size_t kLargest = 64u << 20, kLargestHeader = 4096;

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
  Json message = Json::parse(buffer_.substr(start, length));
  buffer_.erase(0, start + length);
  return message;
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
