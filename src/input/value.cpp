#include "input/value.h"

#include <charconv>

namespace mbcosim {

ValueType type_of(const Value& v) { return static_cast<ValueType>(v.index()); }

const char* type_name(ValueType t) {
  switch (t) {
    case ValueType::boolean:
      return "bool";
    case ValueType::integer:
      return "integer";
    case ValueType::real:
      return "real";
    case ValueType::string:
      return "string";
  }
  return "";
}

std::string number_text(double v) {
  char buffer[32];
  const auto done =
      std::to_chars(buffer, buffer + sizeof buffer, v, std::chars_format::general, 6);  // %g
  return {buffer, done.ptr};
}

std::string printed(double v) {
  std::string r = number_text(v);
  if (r.find('.') == std::string::npos) r += '.';
  return r;
}

std::string printed(const Value& v) {
  switch (type_of(v)) {
    case ValueType::boolean:
      return std::get<bool>(v) ? "1" : "0";
    case ValueType::integer:
      return std::to_string(std::get<std::int32_t>(v));
    case ValueType::real:
      return printed(std::get<double>(v));
    case ValueType::string:
      return '"' + std::get<std::string>(v) + '"';
  }
  return "";
}

}  // namespace mbcosim
