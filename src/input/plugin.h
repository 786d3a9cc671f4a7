/// Plugin variables `[kind, name, ...]` (spec 01 section 5.7).
#pragma once

#include <string_view>

#include "input/symbols.h"

namespace mbcosim {

class Session;

/// Declares the variable that `text`, the inside of the brackets, describes. `where`: offset of the
/// text in the expression. Throws ExpressionError.
Symbol& declare_plugin(Session& session, std::string_view text, std::size_t where);

}  // namespace mbcosim
