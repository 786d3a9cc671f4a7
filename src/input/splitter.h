/// Splits the text of a file into raw statements, each up to its `;`.
#pragma once

#include <optional>

#include "input/cursor.h"

namespace mbcosim {

/// Reads one file from its beginning. A statement ends at the first `;` outside strings, comments,
/// `( )` and `[ ]`.
class Splitter {
 public:
  Splitter(Reading& reading, int file);
  /// The next statement, or nothing at the end of the file. What is wrong is reported to the
  /// reading and skipped.
  std::optional<Statement> next();
  int file() const { return file_; }

 private:
  enum class Trouble { none, unbalanced, nesting, text, comment, end_of_file };
  struct End {
    Trouble trouble = Trouble::none;
    std::size_t at = 0;  ///< of the `;`, or of what is wrong
  };

  bool skip_to_statement();
  std::size_t skip_comment(std::size_t at);
  std::size_t open_string(std::size_t begin, std::size_t last);
  bool finish_statement(std::size_t begin, Statement* statement);
  End find_end(std::size_t begin, bool brackets);
  void recover(std::size_t begin, const End& end);
  bool check_head(std::size_t begin, Statement* statement);
  void report(std::size_t at, std::size_t length, const std::string& message,
              const char* code = "syntax", const std::string& hint = "");

  Reading& reading_;
  int file_;
  std::string_view text_;
  std::size_t at_ = 0;
  bool binary_ = false;  ///< it is no text: nothing more is read
};

}  // namespace mbcosim
