/// Reads the arguments of one raw statement: keywords, expressions, strings. Source: MBDyn input
/// manual, "general" and "numeric values".
#pragma once

#include <string>
#include <string_view>

#include "input/value.h"
#include "model/diagnostic.h"

namespace mbcosim {

class Reading;  // everything that outlives a statement: files, symbols, diagnostics, limits
                // (input/reading.h)

/// One statement as raw text with positions, split off before its meaning is known.
struct Statement {
  std::string_view text;       ///< from the first character of the card word to before the `;`
  int file = 0;                ///< index in Reading::files
  std::size_t offset = 0;      ///< of text in its file
  std::string word;            ///< normalized card word ("controldata" for `control data`)
  bool has_arguments = false;  ///< a `:` follows the word
  std::size_t arguments = 0;   ///< offset in text of what follows the `:`
  int trail = -1;              ///< include and loop context, for messages (index in Reading)
};

/// Sets word, has_arguments and arguments from the text, which starts with a letter. Returns npos,
/// or the end of the word when neither `:` nor the end of the statement follows it.
std::size_t read_head(Statement* statement);

class Cursor {
 public:
  Cursor(Reading& reading, const Statement& statement);  ///< stands before the first argument

  bool more();       ///< are there more arguments?
  bool at_string();  ///< is the next argument a quoted string?
  bool at_empty();   ///< is the next argument empty?
  /// The next argument as a normalized word, when it is one as a whole; empty otherwise. Consumes
  /// nothing.
  std::string peek_word();
  void skip();                              ///< consumes the next argument unread
  std::string word(std::string_view what);  ///< consumes the next argument as a word, normalized
  /// Evaluates the next argument as one expression statement. An empty argument is an error here:
  /// check `at_empty` first.
  Value expression(std::string_view what);
  std::string quoted(std::string_view what);  ///< a quoted argument, escapes decoded
  /// The inside of a quoted argument as a statement of its own, characters as they are written.
  Statement quoted_statement(std::string_view what);
  /// For `driven`: the rest of the statement from the next argument on, as a statement of its own.
  Statement rest_as_statement();
  SourceSpan next();        ///< span of the next argument
  SourceSpan last() const;  ///< span of the argument consumed last
  [[noreturn]] void fail(SourceSpan where, std::string message, std::string hint = "");
  void warn(SourceSpan where, std::string message, std::string hint = "");
  Reading& reading();

 private:
  void finish_argument(std::size_t begin, std::size_t end);
  [[noreturn]] void fail_after(std::size_t begin, std::size_t end, std::string_view what);
  bool plain_number(std::size_t begin, Value* value);

  Reading& reading_;
  Statement statement_;
  std::size_t position_ = 0;  // of the next argument in statement_.text
  bool done_ = false;
  std::size_t last_begin_ = 0, last_end_ = 0;
  std::size_t peeked_ = std::string::npos;  // position of the argument that peeked_word_ belongs to
  std::string peeked_word_;
};

}  // namespace mbcosim
