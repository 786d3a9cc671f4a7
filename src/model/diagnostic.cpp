#include "model/diagnostic.h"

#include <algorithm>

namespace mbcosim {

const char* severity_name(Severity severity) {
  switch (severity) {
    case Severity::error:
      return "error";
    case Severity::warning:
      return "warning";
    case Severity::note:
      return "note";
  }
  return "error";
}

Error make_error(ErrorKind kind, std::string reason, std::string message) {
  Error e;
  e.kind = kind;
  e.reason = std::move(reason);
  e.message = std::move(message);
  return e;
}

Error cancelled_error(std::string message) {
  return make_error(ErrorKind::cancelled, "CANCELLED", std::move(message));
}

namespace {

/// Bytes of the UTF-8 sequence at `text[i]`; 0 when it is none that a terminal can show.
std::size_t shown_bytes(const std::string& text, std::size_t i) {
  const auto byte = [&](std::size_t k) { return static_cast<unsigned char>(text[k]); };
  const unsigned char c = byte(i);
  if (c < 0x80) return c == '\t' || c == '\n' || (c >= 0x20 && c != 0x7f) ? 1 : 0;
  const std::size_t n = c >= 0xf0 && c < 0xf5 ? 4 : c >= 0xe0 ? 3 : c >= 0xc2 ? 2 : 0;
  if (n == 0 || c >= 0xf5 || i + n > text.size()) return 0;
  for (std::size_t k = 1; k < n; ++k)
    if ((byte(i + k) & 0xc0) != 0x80) return 0;
  return n;
}

/// The line with a dot for each byte that is no text.
std::string printable(const std::string& line) {
  std::string r;
  for (std::size_t i = 0; i < line.size();) {
    const std::size_t n = shown_bytes(line, i);
    r += n > 0 ? line.substr(i, n) : ".";
    i += std::max<std::size_t>(n, 1);
  }
  return r;
}

/// The part of a long line around a column, with that column's place in it.
struct Excerpt {
  std::string line;
  int column;
};
Excerpt excerpt(const std::string& line, int column) {
  constexpr std::size_t kWidth = 160, kBefore = 60;
  if (line.size() <= kWidth) return {printable(line), column};
  const std::size_t at = static_cast<std::size_t>(std::max(column - 1, 0));
  const std::size_t begin = at > kBefore ? std::min(at - kBefore, line.size() - kWidth) : 0;
  const bool cut_before = begin > 0, cut_after = begin + kWidth < line.size();
  return {
      (cut_before ? "..." : "") + printable(line.substr(begin, kWidth)) + (cut_after ? "..." : ""),
      column - static_cast<int>(begin) + (cut_before ? 3 : 0)};
}

/// Columns and lengths count bytes.
bool begins_character(char c) { return (static_cast<unsigned char>(c) & 0xc0) != 0x80; }

/// A caret below `column` with a tail below the rest of `length`; tabs stay tabs, so that both
/// lines indent alike.
std::string marks(const std::string& line, int column, int length) {
  std::string below;
  const std::size_t begin =
      std::min(static_cast<std::size_t>(std::max(column - 1, 0)), line.size());
  const std::size_t end =
      std::min(begin + static_cast<std::size_t>(std::max(length, 1)), line.size());
  for (std::size_t i = 0; i < begin; ++i)
    if (begins_character(line[i])) below += line[i] == '\t' ? '\t' : ' ';
  below += '^';
  for (std::size_t i = begin + 1; i < end; ++i)
    if (begins_character(line[i])) below += '~';
  return below;
}

}  // namespace

std::string Diagnostic::text() const {
  std::string r = file;
  if (line > 0) r += ":" + std::to_string(line) + ":" + std::to_string(column);
  if (!r.empty()) r += ": ";
  r += std::string(severity_name(severity)) + ": " + printable(message) + "\n";
  if (!source_line.empty()) {
    const Excerpt shown = excerpt(source_line, column);
    r += "  " + shown.line + "\n  " + marks(shown.line, shown.column, length) + "\n";
  }
  if (!hint.empty()) r += "  hint: " + hint + "\n";
  for (const std::string& t : trail) r += "  " + t + "\n";
  return r;
}

}  // namespace mbcosim
