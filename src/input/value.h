/// Values of the deck's expressions (MBDyn input manual, "numeric values").
#pragma once

#include <cstdint>
#include <string>
#include <variant>

namespace mbcosim {

enum class ValueType { boolean, integer, real, string };

/// bool, 32-bit integer, real or string.
using Value = std::variant<bool, std::int32_t, double, std::string>;

ValueType type_of(const Value& v);
const char* type_name(ValueType t);   ///< "bool", "integer", "real", "string"
std::string printed(const Value& v);  ///< as `remark` prints it
std::string printed(double v);
std::string number_text(double v);  ///< for messages: six digits, no point added

}  // namespace mbcosim
