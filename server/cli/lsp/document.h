/// The text of a deck as an editor sees it: positions, words, declarations.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace mbcosim::lsp {

/// A place in a text: line and UTF-16 unit within it, from 0, as the protocol counts.
struct Position {
  int line = 0, character = 0;
};

struct Range {
  Position start, end;
};

class Document {
 public:
  explicit Document(std::string text);

  const std::string& text() const { return text_; }
  /// Offset [bytes] of a place; one beyond the end of its line or of the text becomes that end.
  std::size_t offset(Position position) const;
  Position position(std::size_t offset) const;
  Range range(std::size_t from, std::size_t size) const;
  /// Place of a line and column [bytes] as the reader counts them, from 1.
  Position from_reader(int line, int column) const;

  /// Is the text at an offset a comment or within quotes?
  bool is_code(std::size_t offset) const { return code_[offset]; }
  /// Name or number around an offset; its first offset goes to `from`.
  std::string word(std::size_t offset, std::size_t& from) const;
  /// What stands between the last `, ; : { ( =` or line's start before an offset and that offset.
  std::string phrase_before(std::size_t offset, std::size_t& from) const;
  /// From the end of the statement before to an offset, without comments.
  std::string statement_before(std::size_t offset) const;

  /// Offsets at which a name is declared by `set:` or `for:`, or a frame by `reference:`, or a node
  /// has it as its label.
  std::vector<std::size_t> declarations(const std::string& word) const;
  /// Offsets of all occurrences of a word outside comments.
  std::vector<std::size_t> occurrences(const std::string& word) const;

 private:
  std::string text_;
  std::vector<std::size_t> lines_;  ///< offsets at which they start
  std::vector<bool> code_;
};

}  // namespace mbcosim::lsp
