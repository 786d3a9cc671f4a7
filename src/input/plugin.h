/// Plugin variables `[kind, name, ...]` (MBDyn input manual, "numeric values").
#pragma once

#include <string_view>

#include "input/symbols.h"

namespace mbcosim {

class Reading;

/// Declares the variable that `text`, the inside of the brackets, describes. `where`: offset of the
/// text in the expression. Throws ExpressionError.
Symbol& declare_plugin(Reading& reading, std::string_view text, std::size_t where);

}  // namespace mbcosim
