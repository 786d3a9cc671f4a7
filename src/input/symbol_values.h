/// Values that the user gives for the deck's symbols.
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "input/symbols.h"
#include "model/diagnostic.h"

namespace mbcosim {

class Reading;

/// `given` as a symbol of `type`; ErrorKind::argument, with what is accepted, when it does not fit.
Result<Value> as_symbol(const Value& given, ValueType type);

/// One error for each name whose declaration was not reached.
std::vector<Diagnostic> unreached_symbols(const Reading& reading);

/// "L=0.5": a number; "on=TRUE": a bool (TRUE, FALSE, true, false); anything else, or what stands
/// in quotes, is a string.
Result<std::pair<std::string, Value>> parse_symbol(std::string_view text);

/// Text that differs where the values do, to the last bit; for digests.
std::string exact_text(const SymbolValues& values);

}  // namespace mbcosim
