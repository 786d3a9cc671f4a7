#include "input/cursor.h"

#include <charconv>
#include <limits>

#include "input/evaluate.h"
#include "input/lexer.h"
#include "input/reading.h"
#include "input/syntax.h"
#include "model/registry.h"

namespace mbcosim {

namespace {

/// Past the argument at `at`: at the `,` that ends it, or the end of the text.
std::size_t skip_argument(std::string_view text, std::size_t at) {
  int depth = 0;
  while (at < text.size()) {
    const char c = text[at];
    if (c == ',' && depth <= 0) return at;
    if (c == '(' || c == '[') ++depth;
    if (c == ')' || c == ']') --depth;
    if (c == '"') {
      at = std::min(skip_string(text, at), text.size());
    } else if (c == '#' || c == '/') {
      const std::size_t next = skip_blanks_slow(text, at);
      at = next > at ? next : at + 1;
    } else {
      ++at;
    }
  }
  return at;
}

}  // namespace

std::size_t read_head(Statement* s) {
  const std::size_t end = skip_words(s->text, 0);
  s->word = normalized(s->text.substr(0, end));
  const std::size_t colon = skip_blanks(s->text, end);
  s->has_arguments = char_at(s->text, colon) == ':';
  s->arguments = s->has_arguments ? colon + 1 : s->text.size();
  return s->has_arguments || colon >= s->text.size() ? std::string_view::npos : end;
}

Cursor::Cursor(Reading& reading, const Statement& statement)
    : reading_(reading),
      statement_(statement),
      position_(statement.arguments),
      done_(!statement.has_arguments),
      last_end_(skip_words(statement.text, 0)) {}

Reading& Cursor::reading() { return reading_; }

bool Cursor::more() { return !done_; }

bool Cursor::at_string() {
  return !done_ && char_at(statement_.text, skip_blanks(statement_.text, position_)) == '"';
}

bool Cursor::at_empty() {
  if (done_) return true;
  const std::size_t at = skip_blanks(statement_.text, position_);
  return at >= statement_.text.size() || statement_.text[at] == ',';
}

void Cursor::finish_argument(std::size_t begin, std::size_t end) {
  const std::string_view text = statement_.text;
  last_begin_ = begin;
  last_end_ = end;
  const std::size_t at = skip_blanks(text, end);
  if (at >= text.size()) {
    done_ = true;
    position_ = text.size();
  } else {
    position_ = at + 1;  // past the comma
  }
}

std::string Cursor::peek_word() {
  if (done_) return {};
  if (peeked_ == position_) return peeked_word_;
  const std::string_view text = statement_.text;
  const std::size_t begin = skip_blanks(text, position_);
  peeked_ = position_;
  peeked_word_.clear();
  if (begin >= text.size() || !is_word_start(text[begin])) return {};
  const std::size_t end = skip_words(text, begin);
  const char after = char_at(text, skip_blanks(text, end));
  if (after == ',' || after == '\0') peeked_word_ = normalized(text.substr(begin, end - begin));
  return peeked_word_;
}

void Cursor::skip() {
  if (done_) return;
  const std::size_t begin = skip_blanks(statement_.text, position_);
  finish_argument(begin, skip_argument(statement_.text, position_));
}

/// The argument at `begin` goes on at `end` with something that does not belong to it.
void Cursor::fail_after(std::size_t begin, std::size_t end, std::string_view what) {
  const std::string_view text = statement_.text;
  const auto span = [&](std::size_t from, std::size_t to) {
    return reading_.span(statement_.file, statement_.offset + from, to - from);
  };
  if (begins_card(text, end) || begins_card(text, begin)) {
    const int line = span(0, 1).line;
    const std::size_t at = begins_card(text, end) ? end : begin;
    fail(span(at, skip_words(text, at)),
         "\";\" expected at the end of the card begun at line " + std::to_string(line),
         "end that card with \";\"");
  }
  const std::size_t stop = skip_argument(text, begin);
  const std::string_view whole = text.substr(begin, stop - begin);
  if (is_word_start(char_at(text, begin)) && whole.find("/*") != std::string_view::npos)
    fail(span(begin, stop),
         "unknown word \"" + excerpt(whole) + "\"; comments are not allowed inside keywords");
  fail(span(begin, stop), std::string(what) + " expected, found \"" + excerpt(whole) + '"');
}

std::string Cursor::word(std::string_view what) {
  const std::string_view text = statement_.text;
  if (done_) fail(next(), std::string(what) + " expected, but the card ends here");
  const std::size_t begin = skip_blanks(text, position_);
  if (begin >= text.size() || text[begin] == ',')
    fail(next(), std::string(what) + " expected, found an empty argument");
  if (!is_word_start(text[begin])) fail_after(begin, begin, what);
  const std::size_t end = skip_words(text, begin);
  const char after = char_at(text, skip_blanks(text, end));
  if (after != ',' && after != '\0') fail_after(begin, end, what);
  finish_argument(begin, end);
  return normalized(text.substr(begin, end - begin));
}

/// Reads `[+|-] digits [. digits] [e digits]` when it is the whole argument.
bool Cursor::plain_number(std::size_t begin, Value* value) {
  const std::string_view text = statement_.text;
  const char* const first = text.data() + begin;
  const char* const end = text.data() + text.size();
  const char* p = first;
  const bool negative = p < end && *p == '-';
  if (negative) ++p;
  const char* const number = p;
  std::int64_t integer = 0;
  while (p < end && is_digit(*p) && p - number < 10) integer = 10 * integer + (*p++ - '0');
  const auto ends = [&](const char* q) {
    while (q < end && is_blank(*q)) ++q;
    return q == end || *q == ',';
  };
  if (p > number && ends(p) && integer <= std::numeric_limits<std::int32_t>::max()) {
    *value = static_cast<std::int32_t>(negative ? -integer : integer);
    finish_argument(begin, p - text.data());
    return true;
  }
  if (number >= end ||
      !(is_digit(*number) || (*number == '.' && number + 1 < end && is_digit(number[1]))))
    return false;
  double real = 0;
  const auto [after, error] = std::from_chars(number, end, real);
  if (error != std::errc() || !ends(after)) return false;
  if (real == 0 &&
      std::string_view(number, after - number).find_first_of("123456789") != std::string_view::npos)
    return false;
  if (std::string_view(number, after - number).find_first_of(".eE") == std::string_view::npos)
    return false;
  *value = negative ? -real : real;
  finish_argument(begin, after - text.data());
  return true;
}

Value Cursor::expression(std::string_view what) {
  const std::string_view text = statement_.text;
  if (done_) fail(next(), std::string(what) + " expected, but the card ends here");
  const std::size_t begin = skip_blanks(text, position_);
  if (begin >= text.size() || text[begin] == ',')
    fail(next(), std::string(what) + " expected, found an empty argument");
  Value value;
  if (plain_number(begin, &value)) return value;
  std::size_t end = begin;
  value = evaluate_argument(reading_, statement_, begin, &end);
  std::size_t last = end;
  while (last > begin && is_blank(text[last - 1])) --last;
  finish_argument(begin, last);
  position_ = std::min(end + 1, text.size());
  done_ = end >= text.size();
  return value;
}

std::string Cursor::quoted(std::string_view what) {
  const std::string_view text = statement_.text;
  if (done_) fail(next(), std::string(what) + " expected, but the card ends here");
  const std::size_t begin = skip_blanks(text, position_);
  if (char_at(text, begin) != '"')
    fail(next(), std::string(what) + " must be enclosed in double quotes");
  const std::size_t end = std::min(skip_string(text, begin), text.size());
  std::string decoded;
  const std::size_t wrong = decode_quoted(text.substr(begin + 1, end - begin - 2), &decoded);
  const auto span = [&](std::size_t at, std::size_t length) {
    return reading_.span(statement_.file, statement_.offset + at, length);
  };
  if (wrong != std::string_view::npos)
    fail(span(begin + 1 + wrong, 2), "unknown escape in a quoted argument",
         "the escapes are \\\\, \\\", \\hh (two hexadecimal digits) and \\ at a line end");
  const std::size_t after = skip_blanks(text, end);
  if (after < text.size() && text[after] != ',') {
    if (begins_card(text, after)) fail_after(after, after, what);
    fail(span(after, 1), "\",\" or \";\" expected after the quoted argument",
         "a quoted argument is not an expression");
  }
  finish_argument(begin, end);
  return decoded;
}

Statement Cursor::quoted_statement(std::string_view what) {
  quoted(what);
  Statement s = statement_;
  s.text = statement_.text.substr(last_begin_ + 1, last_end_ - last_begin_ - 2);
  s.offset = statement_.offset + last_begin_ + 1;
  return s;
}

Statement Cursor::rest_as_statement() {
  Statement s = statement_;
  const std::size_t begin = skip_blanks(statement_.text, position_);
  s.text = statement_.text.substr(std::min(begin, statement_.text.size()));
  s.offset = statement_.offset + begin;
  if (s.text.empty() || !is_word_start(s.text[0])) fail(next(), "card name expected");
  const std::size_t end = read_head(&s);
  if (end != std::string_view::npos)
    fail(reading_.span(s.file, s.offset + end, 1),
         "\":\" expected after \"" + excerpt(s.text.substr(0, end)) + '"');
  done_ = true;
  last_begin_ = begin;
  last_end_ = statement_.text.size();
  position_ = statement_.text.size();
  return s;
}

SourceSpan Cursor::next() {
  const std::string_view text = statement_.text;
  if (done_) {
    // The last character of the statement: what is missing should follow it.
    std::size_t at = text.size();
    while (at > 1 && is_blank(text[at - 1])) --at;
    return reading_.span(statement_.file, statement_.offset + at - 1, 1);
  }
  const std::size_t begin = skip_blanks(text, position_);
  std::size_t end = std::max(skip_argument(text, begin), begin);
  while (end > begin && is_blank(text[end - 1])) --end;
  return reading_.span(statement_.file, statement_.offset + begin,
                       std::max<std::size_t>(end - begin, 1));
}

SourceSpan Cursor::last() const {
  return reading_.span(statement_.file, statement_.offset + last_begin_,
                       std::max<std::size_t>(last_end_ - last_begin_, 1));
}

void Cursor::fail(SourceSpan where, std::string message, std::string hint) {
  reading_.fail(where, std::move(message), std::move(hint));
}

void Cursor::warn(SourceSpan where, std::string message, std::string hint) {
  reading_.warn(where, std::move(message), std::move(hint));
}

}  // namespace mbcosim
