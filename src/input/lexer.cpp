#include "input/lexer.h"

namespace mbcosim {

namespace {

int hex_digit(char c) {
  if (is_digit(c)) return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

/// Length of the line end at `at`: 0, 1 (LF) or 2 (CR LF).
std::size_t line_end(std::string_view text, std::size_t at) {
  if (char_at(text, at) == '\n') return 1;
  return char_at(text, at) == '\r' && char_at(text, at + 1) == '\n' ? 2 : 0;
}

}  // namespace

std::string_view character_at(std::string_view text, std::size_t at) {
  const auto byte = [&](std::size_t k) {
    return static_cast<unsigned char>(char_at(text, at + k));
  };
  const std::size_t n = byte(0) < 0xc0 ? 1 : byte(0) < 0xe0 ? 2 : byte(0) < 0xf0 ? 3 : 4;
  for (std::size_t k = 1; k < n; ++k)
    if ((byte(k) & 0xc0) != 0x80) return text.substr(at, 1);
  return text.substr(at, n);
}

std::size_t skip_line_comment(std::string_view text, std::size_t at) {
  while (true) {
    at = text.find('\n', at);
    if (at == std::string_view::npos) return text.size();
    std::size_t before = at;
    if (before > 0 && text[before - 1] == '\r') --before;
    if (before == 0 || text[before - 1] != '\\') return at;
    ++at;
  }
}

std::size_t skip_block_comment(std::string_view text, std::size_t at) {
  at = text.find("*/", at + 2);
  return at == std::string_view::npos ? at : at + 2;
}

std::size_t skip_string(std::string_view text, std::size_t at) {
  for (++at; at < text.size(); ++at) {
    if (text[at] == '"') return at + 1;
    if (text[at] == '\\') ++at;
  }
  return std::string_view::npos;
}

std::size_t skip_blanks_slow(std::string_view text, std::size_t at) {
  while (at < text.size()) {
    if (is_blank(text[at])) {
      ++at;
    } else if (text[at] == '#') {
      at = skip_line_comment(text, at);
    } else if (text[at] == '/' && char_at(text, at + 1) == '*') {
      at = skip_block_comment(text, at);
      if (at == std::string_view::npos) return text.size();
    } else {
      return at;
    }
  }
  return at;
}

std::size_t skip_words(std::string_view text, std::size_t at) {
  std::size_t end = at;
  for (; at < text.size(); ++at) {
    if (is_word_char(text[at]))
      end = at + 1;
    else if (!is_blank(text[at]))
      break;
  }
  return end;
}

std::size_t skip_identifier(std::string_view text, std::size_t at) {
  while (at < text.size() && is_word_char(text[at])) ++at;
  return at;
}

std::string excerpt(std::string_view text) {
  constexpr std::size_t longest = 40;
  std::string r;
  bool blank = false;
  for (const char c : text) {
    if (is_blank(c)) {
      blank = !r.empty();
      continue;
    }
    if (blank) r += ' ';
    blank = false;
    r += static_cast<unsigned char>(c) < ' ' ? '?' : c;
    if (r.size() > longest) return r.substr(0, longest - 3) + "...";
  }
  return r;
}

bool begins_card(std::string_view text, std::size_t at) {
  if (at >= text.size() || !is_word_start(text[at])) return false;
  const std::size_t end = skip_blanks(text, skip_words(text, at));
  return char_at(text, end) == ':' && char_at(text, end + 1) != ':';
}

std::size_t decode_quoted(std::string_view raw, std::string* decoded) {
  decoded->clear();
  for (std::size_t i = 0; i < raw.size(); ++i) {
    if (raw[i] != '\\') {
      *decoded += raw[i];
      continue;
    }
    const char c = char_at(raw, i + 1);
    if (c == '\\' || c == '"') {
      *decoded += c;
      ++i;
    } else if (const std::size_t n = line_end(raw, i + 1)) {
      i += n;
    } else if (hex_digit(c) >= 0 && hex_digit(char_at(raw, i + 2)) >= 0) {
      *decoded += static_cast<char>(16 * hex_digit(c) + hex_digit(raw[i + 2]));
      i += 2;
    } else {
      return i;
    }
  }
  return std::string_view::npos;
}

std::string decode_literal(std::string_view raw) {
  std::string r;
  for (std::size_t i = 0; i < raw.size(); ++i) {
    if (raw[i] == '\\' && i + 1 < raw.size()) ++i;
    r += raw[i];
  }
  return r;
}

}  // namespace mbcosim
