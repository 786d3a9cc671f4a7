/// Limits against hostile or runaway decks and models.
#pragma once

#include <cstdint>

namespace mbcosim {

/// Exceeding one is a diagnostic with code `limit-<name>` ("limit-include-depth") and
/// ErrorKind::limit.
struct Limits {
  std::int64_t deck_bytes = 256 << 20;  ///< total bytes read for one deck
  int include_depth = 100;
  int include_count = 100000;
  std::int64_t statements = 20'000'000;
  std::int64_t loop_iterations = 1'000'000;  ///< passes of one loop
  int expression_depth = 200;                ///< nested parentheses and functions of one expression
  int nesting_depth = 100;                   ///< nested `for`, `if` and brackets of one statement
  std::int64_t unknowns = 50'000'000;
  int errors = 20;  ///< reading stops after so many
};

}  // namespace mbcosim
