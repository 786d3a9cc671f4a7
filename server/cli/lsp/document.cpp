#include "cli/lsp/document.h"

#include <algorithm>
#include <cctype>
#include <regex>

namespace mbcosim::lsp {
namespace {

bool is_word(char c) { return std::isalnum(static_cast<unsigned char>(c)) || c == '_'; }

/// Bytes of the UTF-8 character that begins with `c`, and the UTF-16 units that it takes.
int bytes_of(char c) {
  const auto u = static_cast<unsigned char>(c);
  return u < 0x80 ? 1 : u < 0xE0 ? 2 : u < 0xF0 ? 3 : 4;
}
int units_of(char c) { return bytes_of(c) == 4 ? 2 : 1; }

/// For each byte whether it is code: neither in a comment (`#` to the end of the line, `/* */`) nor
/// in quotes.
std::vector<bool> mark_code(const std::string& text) {
  std::vector<bool> code(text.size() + 1, true);
  for (std::size_t k = 0; k < text.size(); ++k) {
    std::size_t end = k;
    if (text[k] == '#')
      end = text.find('\n', k);
    else if (text.compare(k, 2, "/*") == 0)
      end = text.find("*/", k + 2);
    else if (text[k] == '"') {
      end = k + 1;
      while (end < text.size() && text[end] != '"') end += text[end] == '\\' ? 2 : 1;
    } else
      continue;
    end = std::min(end, text.size());
    std::fill(code.begin() + static_cast<std::ptrdiff_t>(k),
              code.begin() + static_cast<std::ptrdiff_t>(end), false);
    k = end;
  }
  return code;
}

}  // namespace

Document::Document(std::string text) : text_(std::move(text)), code_(mark_code(text_)) {
  lines_.push_back(0);
  for (std::size_t k = 0; k < text_.size(); ++k)
    if (text_[k] == '\n') lines_.push_back(k + 1);
}

std::size_t Document::offset(Position position) const {
  const auto line = static_cast<std::size_t>(std::max(position.line, 0));
  if (line >= lines_.size()) return text_.size();
  std::size_t at = lines_[line];
  for (int units = 0; units < position.character && at < text_.size() && text_[at] != '\n';) {
    units += units_of(text_[at]);
    at += static_cast<std::size_t>(bytes_of(text_[at]));
  }
  return std::min(at, text_.size());
}

Position Document::position(std::size_t offset) const {
  offset = std::min(offset, text_.size());
  const auto after = std::upper_bound(lines_.begin(), lines_.end(), offset);
  Position position{static_cast<int>(after - lines_.begin()) - 1, 0};
  for (std::size_t at = *(after - 1); at < offset;
       at += static_cast<std::size_t>(bytes_of(text_[at])))
    position.character += units_of(text_[at]);
  return position;
}

Range Document::range(std::size_t from, std::size_t size) const {
  return {position(from), position(from + size)};
}

Position Document::from_reader(int line, int column) const {
  if (line < 1 || static_cast<std::size_t>(line) > lines_.size()) return position(text_.size());
  return position(lines_[static_cast<std::size_t>(line) - 1] +
                  static_cast<std::size_t>(std::max(column, 1)) - 1);
}

std::string Document::word(std::size_t offset, std::size_t& from) const {
  from = offset;
  while (from > 0 && is_word(text_[from - 1])) --from;
  std::size_t end = offset;
  while (end < text_.size() && is_word(text_[end])) ++end;
  return text_.substr(from, end - from);
}

std::string Document::phrase_before(std::size_t offset, std::size_t& from) const {
  from = offset;
  while (from > 0 && std::string_view(",;:{}()=\n").find(text_[from - 1]) == std::string_view::npos)
    --from;
  while (from < offset && text_[from] == ' ') ++from;
  return text_.substr(from, offset - from);
}

std::string Document::statement_before(std::size_t offset) const {
  std::size_t from = offset;
  while (from > 0 && !(text_[from - 1] == ';' && code_[from - 1])) --from;
  std::string text;
  for (std::size_t k = from; k < offset; ++k)
    if (code_[k] || text_[k] == '"') text += text_[k];
  return text;
}

std::vector<std::size_t> Document::declarations(const std::string& word) const {
  std::vector<std::size_t> found;
  if (word.empty() || !std::all_of(word.begin(), word.end(), is_word)) return found;
  const std::regex symbol(
      "(?:\\bset\\s*:\\s*(?:ifndef\\s+)?(?:const\\s+)?(?:bool|integer|real|string)\\s+|"
      "\\bfor\\s*:\\s*integer\\s+|\\breference\\s*:\\s*|"
      "\\b(?:structural|abstract|electric|hydraulic|parameter|thermal)\\s*:\\s*)" +
      word + "\\b");
  for (std::sregex_iterator at(text_.begin(), text_.end(), symbol), end; at != end; ++at) {
    const auto start = static_cast<std::size_t>(at->position());
    if (code_[start]) found.push_back(start + static_cast<std::size_t>(at->length()) - word.size());
  }
  return found;
}

std::vector<std::size_t> Document::occurrences(const std::string& word) const {
  std::vector<std::size_t> found;
  if (word.empty()) return found;
  for (std::size_t at = text_.find(word); at != std::string::npos; at = text_.find(word, at + 1)) {
    const bool whole = (at == 0 || !is_word(text_[at - 1])) &&
                       (at + word.size() >= text_.size() || !is_word(text_[at + word.size()]));
    if (whole && code_[at]) found.push_back(at);
  }
  return found;
}

}  // namespace mbcosim::lsp
