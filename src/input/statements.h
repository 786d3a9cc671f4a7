/// Delivers the statements of a deck one by one: includes opened, `for` and `if` blocks run, and
/// the cards that may stand anywhere and need no model (`set`, `remark`, `include`, `print symbol
/// table`, `setenv`, ...) done on the way.
#pragma once

#include <memory>
#include <optional>

#include "input/cursor.h"

namespace mbcosim {

class Statements {
 public:
  explicit Statements(Reading& reading);
  ~Statements();
  /// The next statement of the deck proper, or nothing at the end. Errors inside go to the
  /// diagnostics of `Reading`; it goes on with the next statement.
  std::optional<Statement> next();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace mbcosim
