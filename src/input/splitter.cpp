#include "input/splitter.h"

#include <array>

#include "input/lexer.h"
#include "input/reading.h"

namespace mbcosim {

namespace {

constexpr std::size_t kLongestWord = 200;

/// Characters that mean something to the splitter.
constexpr std::array<bool, 256> kSpecial = [] {
  std::array<bool, 256> t{};
  for (const unsigned char c : {'"', '#', '/', '(', ')', '[', ']', ';'}) t[c] = true;
  return t;
}();

}  // namespace

Splitter::Splitter(Reading& reading, int file)
    : reading_(reading), file_(file), text_(reading.file(file).text) {
  if (text_.substr(0, 3) == "\xEF\xBB\xBF") at_ = 3;
}

void Splitter::report(std::size_t at, std::size_t length, const std::string& message,
                      const char* code, const std::string& hint) {
  if (const std::size_t zero = text_.find('\0'); zero != std::string_view::npos) {
    binary_ = true;
    reading_.report(reading_.diagnostic(
        Severity::error, "syntax", reading_.span(file_, zero, 1),
        "this file is no text: it has bytes that are zero",
        "a deck is text in ASCII or UTF-8: check the name of the file, or save it as such"));
    return;
  }
  reading_.report(
      reading_.diagnostic(Severity::error, code, reading_.span(file_, at, length), message, hint));
}

/// Of an unterminated string in the statement from `begin` on: the first string that does not end
/// on its line. Quotes pair up wrongly from there on. None: the last one, at `last`.
std::size_t Splitter::open_string(std::size_t begin, std::size_t last) {
  for (std::size_t at = begin; at < last;) {
    if (text_[at] == '#') {
      at = skip_line_comment(text_, at);
    } else if (text_[at] == '/' && char_at(text_, at + 1) == '*') {
      at = skip_block_comment(text_, at);
    } else if (text_[at] == '"') {
      const std::size_t end = skip_string(text_, at);
      if (text_.substr(at, end - at).find('\n') != std::string_view::npos) return at;
      at = end;
    } else {
      ++at;
    }
  }
  return last;
}

/// Past the comment at `at`, or npos.
std::size_t Splitter::skip_comment(std::size_t at) {
  const std::size_t end = skip_block_comment(text_, at);
  const std::size_t inner = text_.find("/*", at + 2);
  if (end != std::string_view::npos && inner < end - 2)
    reading_.warn(reading_.span(file_, inner, 2), "\"/*\" inside a comment",
                  "comments do not nest: this one ends at the first \"*/\"");
  return end;
}

/// Past blanks and comments between statements; false at the end of the file.
bool Splitter::skip_to_statement() {
  while (at_ < text_.size()) {
    if (is_blank(text_[at_])) {
      ++at_;
    } else if (text_[at_] == '#') {
      at_ = skip_line_comment(text_, at_);
    } else if (text_[at_] == '/' && char_at(text_, at_ + 1) == '*') {
      const std::size_t end = skip_comment(at_);
      if (end == std::string_view::npos) {
        recover(at_, {Trouble::comment, at_});
        return false;
      }
      at_ = end;
    } else {
      return true;
    }
  }
  return false;
}

Splitter::End Splitter::find_end(std::size_t begin, bool brackets) {
  std::vector<std::size_t> open;
  std::size_t at = begin;
  while (true) {
    while (at < text_.size() && !kSpecial[static_cast<unsigned char>(text_[at])]) ++at;
    if (at >= text_.size())
      return open.empty() ? End{Trouble::end_of_file, at} : End{Trouble::unbalanced, open.back()};
    const char c = text_[at];
    if (c == ';') {
      if (open.empty()) return {Trouble::none, at};
      ++at;
    } else if (c == '"') {
      const std::size_t end = skip_string(text_, at);
      if (end == std::string_view::npos) return {Trouble::text, at};
      at = end;
    } else if (c == '#') {
      at = skip_line_comment(text_, at);
    } else if (c == '/' && char_at(text_, at + 1) == '*') {
      const std::size_t end = skip_comment(at);
      if (end == std::string_view::npos) return {Trouble::comment, at};
      at = end;
    } else {
      if (brackets && (c == '(' || c == '[')) {
        if (static_cast<int>(open.size()) >= reading_.limits.nesting_depth)
          return {Trouble::nesting, at};
        open.push_back(at);
      }
      if ((c == ')' || c == ']') && !open.empty()) open.pop_back();
      ++at;
    }
  }
}

/// Reports and goes on after the next `;`, whatever brackets are open.
void Splitter::recover(std::size_t begin, const End& end) {
  const std::string c = end.at < text_.size() ? text_.substr(end.at, 1) == "[" ? "[" : "(" : "";
  switch (end.trouble) {
    case Trouble::none:
      at_ = end.at + 1;
      return;
    case Trouble::nesting:
      report(end.at, 1,
             "brackets nested deeper than " + std::to_string(reading_.limits.nesting_depth) +
                 " levels (limit `nesting-depth`)",
             "limit-nesting-depth");
      at_ = text_.size();
      return;
    case Trouble::text:
      report(open_string(begin, end.at), 1, "unterminated string", "syntax",
             "end it with a double quote");
      break;
    case Trouble::comment:
      report(end.at, 2, "unterminated comment", "syntax", "end it with `*/`");
      break;
    case Trouble::end_of_file:
      report(text_.empty() ? 0 : text_.size() - 1, 1, "\";\" expected at end of file", "syntax",
             "end the last card with \";\"");
      break;
    case Trouble::unbalanced: {
      report(end.at, 1,
             "unbalanced \"" + c + "\" opened at column " +
                 std::to_string(reading_.span(file_, end.at, 1).column),
             "syntax", std::string("close it with \"") + (c == "[" ? "]" : ")") + "\"");
      const End plain = find_end(begin, false);
      at_ = plain.trouble == Trouble::none ? plain.at + 1 : text_.size();
      return;
    }
  }
  at_ = text_.size();
}

bool Splitter::check_head(std::size_t begin, Statement* s) {
  const std::size_t end = read_head(s);
  const std::string_view word = s->text.substr(0, skip_words(s->text, 0));
  if (word.size() > kLongestWord) {
    report(begin, word.size(),
           "card name longer than " + std::to_string(kLongestWord) + " characters");
    return false;
  }
  if (end == std::string_view::npos) return true;
  const std::size_t next = skip_blanks(s->text, end);
  if (is_word_start(s->text[next])) {
    const std::string all = excerpt(s->text.substr(0, skip_words(s->text, next)));
    report(begin, next, "unknown word \"" + all + "\"; comments are not allowed inside keywords");
    return false;
  }
  std::size_t name = 0;
  while (name < word.size() &&
         !(is_blank(word[name]) && is_digit(char_at(word, skip_blanks(word, name)))))
    ++name;
  report(begin + name, std::max<std::size_t>(next - name, 1),
         "\":\" expected after \"" + excerpt(word.substr(0, name)) + '"');
  return false;
}

bool Splitter::finish_statement(std::size_t begin, Statement* s) {
  const End end = find_end(begin, true);
  if (end.trouble != Trouble::none) {
    recover(begin, end);
    return false;
  }
  at_ = end.at + 1;
  s->file = file_;
  s->offset = begin;
  s->text = text_.substr(begin, end.at - begin);
  return check_head(begin, s);
}

std::optional<Statement> Splitter::next() {
  while (!binary_ && !reading_.full() && skip_to_statement()) {
    const std::size_t begin = at_;
    const char c = text_[begin];
    if (is_word_start(c)) {
      Statement s;
      if (finish_statement(begin, &s)) return s;
      continue;
    }
    if (c == ';') {
      report(begin, 1, "empty statement; card name expected");
      ++at_;
      continue;
    }
    if (is_digit(c)) {
      report(begin, 1, "card name expected, number found");
    } else {
      const std::string_view found = character_at(text_, begin);
      report(begin, found.size(), "card name expected, found \"" + excerpt(found) + '"', "syntax",
             is_ascii(c) ? "" : kAsciiAlone);
    }
    const End end = find_end(begin, true);
    if (end.trouble == Trouble::none || end.trouble == Trouble::nesting)
      recover(begin, end);
    else
      at_ = text_.size();
  }
  return std::nullopt;
}

}  // namespace mbcosim
