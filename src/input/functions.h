/// Built-in functions of expressions (MBDyn input manual, "numeric values", functions).
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "input/value.h"

namespace mbcosim {

enum class FunctionId : std::uint8_t {
  sin,
  cos,
  tan,
  ctan,
  asin,
  acos,
  atan,
  actan,
  atan2,
  actan2,
  exp,
  log,
  log10,
  sinh,
  cosh,
  tanh,
  ctanh,
  asinh,
  acosh,
  atanh,
  actanh,
  sqrt,
  abs,
  floor,
  ceil,
  round,
  sign,
  copysign,
  min,
  max,
  step,
  ramp,
  sramp,
  par,
  in_ll,
  in_le,
  in_el,
  in_ee,
  rand,
  random,
  seed,
  print,
  stop,
  sprintf,
  to_bool,
  to_integer,
  to_real,
  to_string,
};

struct Function {
  const char* name;
  FunctionId id;
  const char* arguments;  ///< a letter each: R real, I integer, S string, A any
  ValueType result;
  bool pure;  ///< the same arguments give the same value and nothing else happens
};

const Function* find_function(std::string_view name);
std::string nearest_function(std::string_view name);
std::vector<std::string> expression_function_names();

/// Formats one value by a C format with exactly one conversion of its type; throws EvaluationError
/// with the reason.
std::string format_value(const std::string& format, const Value& value);

}  // namespace mbcosim
