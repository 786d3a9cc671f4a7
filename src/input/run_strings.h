/// Run-time strings: expressions of the deck that are evaluated during the run
/// (MBDyn input manual, "string drive caller").
///
/// A string is parsed once, when its card is read; names are bound at the end of the deck
/// (`Reading::bind_strings`). Variables of enclosing loop passes are captured at once.
#pragma once

#include <string>
#include <vector>

#include "input/reading.h"

namespace mbcosim {

/// `where`: the quoted argument. Throws DeckError for what is wrong in the text itself.
DrivePtr compile_string(Reading& reading, const std::string& text, SourceSpan where);

/// The same with further real variables `names`; at most 12.
ExpressionPtr compile_expression(Reading& reading, const std::string& text,
                                 const std::vector<std::string>& names, SourceSpan where);

}  // namespace mbcosim
