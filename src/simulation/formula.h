/// Formulas of named numbers that come from outside of decks.
#pragma once

#include <string>
#include <vector>

#include "model/diagnostic.h"
#include "model/expression.h"

namespace mbcosim {

/// Compiles a formula in the language of decks; `names` are its variables, in the order of the
/// arguments, at most 12. ErrorKind::argument tells what is wrong.
Result<ExpressionPtr> compile_formula(const std::string& text,
                                      const std::vector<std::string>& names);

}  // namespace mbcosim
