/// Characters, comments and strings of the deck language (MBDyn input manual, "general"), on plain
/// text with offsets.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace mbcosim {

inline bool is_blank(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }
inline bool is_digit(char c) { return c >= '0' && c <= '9'; }
inline bool is_word_start(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_';
}
inline bool is_word_char(char c) { return is_word_start(c) || is_digit(c); }

/// The character at `at`, or NUL past the end.
inline char char_at(std::string_view text, std::size_t at) {
  return at < text.size() ? text[at] : '\0';
}

/// The whole character at `at` where it is UTF-8, else its byte.
std::string_view character_at(std::string_view text, std::size_t at);
inline bool is_ascii(char c) { return static_cast<unsigned char>(c) < 0x80; }
/// What to do about a character outside ASCII where none may stand.
inline constexpr char kAsciiAlone[] =
    "letters with accents, typographic quotes, dashes and blanks may stand in strings and comments "
    "alone: type this character anew";

/// Past a `#` comment that starts at `at`: at its line end. A backslash before the line end
/// continues it.
std::size_t skip_line_comment(std::string_view text, std::size_t at);
/// Past a `/*` comment that starts at `at`; npos when it does not end.
std::size_t skip_block_comment(std::string_view text, std::size_t at);
/// Past a string whose opening quote is at `at`; npos when it does not end.
std::size_t skip_string(std::string_view text, std::size_t at);
/// Past white space and comments; at the end of the text when a comment does not end.
std::size_t skip_blanks_slow(std::string_view text, std::size_t at);
inline std::size_t skip_blanks(std::string_view text, std::size_t at) {
  while (at < text.size() && is_blank(text[at])) ++at;
  return at < text.size() && (text[at] == '#' || text[at] == '/') ? skip_blanks_slow(text, at) : at;
}
/// Past the longest run of letters, digits, `_` and white space, less the white space at its end.
std::size_t skip_words(std::string_view text, std::size_t at);
/// Past the letters, digits and `_` at `at`.
std::size_t skip_identifier(std::string_view text, std::size_t at);
/// A piece of text for messages: one line, at most 40 characters.
std::string excerpt(std::string_view text);
/// Is there a lone `:` (not `::`) right after the words at `at`? Then a new card begins there and a
/// `;` is missing.
bool begins_card(std::string_view text, std::size_t at);

/// Decodes the inside of a quoted argument. On a wrong escape returns its offset in
/// `raw`, else npos.
std::size_t decode_quoted(std::string_view raw, std::string* decoded);
/// Decodes the inside of a string literal of an expression: `\c` is c.
std::string decode_literal(std::string_view raw);

}  // namespace mbcosim
