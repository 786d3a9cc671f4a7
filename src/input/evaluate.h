/// Evaluation of the expressions of cards, once, while the deck is read.
#pragma once

#include <string_view>

#include "input/program.h"
#include "input/reading.h"
#include "input/syntax.h"

namespace mbcosim {

struct Statement;

/// Buffers that are used again from expression to expression.
struct ExpressionScratch {
  Syntax syntax;
  Program program;
  Frame<double> frame;
};

/// Evaluates the argument at `begin` of the statement's text, which ends there or at a `,` (`end`).
/// Throws DeckError.
Value evaluate_argument(Reading& reading, const Statement& statement, std::size_t begin,
                        std::size_t* end);

/// The value of a constant sub-expression that is given as text: labels inside plugin variables.
/// `where`: its offset in the enclosing expression. Throws ExpressionError.
Value evaluate_part(Reading& reading, std::string_view text, std::size_t where);

}  // namespace mbcosim
