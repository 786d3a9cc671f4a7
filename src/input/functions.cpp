#include "input/functions.h"

#include <cstdio>
#include <unordered_map>

#include "input/lexer.h"
#include "input/nearest.h"
#include "model/diagnostic.h"

namespace mbcosim {

namespace {

constexpr ValueType kReal = ValueType::real;
constexpr ValueType kInteger = ValueType::integer;

constexpr Function kFunctions[] = {
    {"sin", FunctionId::sin, "R", kReal, true},
    {"cos", FunctionId::cos, "R", kReal, true},
    {"tan", FunctionId::tan, "R", kReal, true},
    {"ctan", FunctionId::ctan, "R", kReal, true},
    {"asin", FunctionId::asin, "R", kReal, true},
    {"acos", FunctionId::acos, "R", kReal, true},
    {"atan", FunctionId::atan, "R", kReal, true},
    {"actan", FunctionId::actan, "R", kReal, true},
    {"atan2", FunctionId::atan2, "RR", kReal, true},
    {"actan2", FunctionId::actan2, "RR", kReal, true},
    {"exp", FunctionId::exp, "R", kReal, true},
    {"log", FunctionId::log, "R", kReal, true},
    {"log10", FunctionId::log10, "R", kReal, true},
    {"sinh", FunctionId::sinh, "R", kReal, true},
    {"cosh", FunctionId::cosh, "R", kReal, true},
    {"tanh", FunctionId::tanh, "R", kReal, true},
    {"ctanh", FunctionId::ctanh, "R", kReal, true},
    {"asinh", FunctionId::asinh, "R", kReal, true},
    {"acosh", FunctionId::acosh, "R", kReal, true},
    {"atanh", FunctionId::atanh, "R", kReal, true},
    {"actanh", FunctionId::actanh, "R", kReal, true},
    {"sqrt", FunctionId::sqrt, "R", kReal, true},
    {"abs", FunctionId::abs, "R", kReal, true},
    {"floor", FunctionId::floor, "R", kReal, true},
    {"ceil", FunctionId::ceil, "R", kReal, true},
    {"round", FunctionId::round, "R", kReal, true},
    {"sign", FunctionId::sign, "R", kInteger, true},
    {"copysign", FunctionId::copysign, "RR", kReal, true},
    {"min", FunctionId::min, "RR", kReal, true},
    {"max", FunctionId::max, "RR", kReal, true},
    {"step", FunctionId::step, "R", kReal, true},
    {"ramp", FunctionId::ramp, "R", kReal, true},
    {"sramp", FunctionId::sramp, "RR", kReal, true},
    {"par", FunctionId::par, "R", kReal, true},
    {"in_ll", FunctionId::in_ll, "RRR", kReal, true},
    {"in_le", FunctionId::in_le, "RRR", kReal, true},
    {"in_el", FunctionId::in_el, "RRR", kReal, true},
    {"in_ee", FunctionId::in_ee, "RRR", kReal, true},
    {"rand", FunctionId::rand, "", kInteger, false},
    {"random", FunctionId::random, "", kReal, false},
    {"seed", FunctionId::seed, "I", kInteger, false},
    {"print", FunctionId::print, "R", kInteger, false},
    {"stop", FunctionId::stop, "II", kInteger, false},
    {"sprintf", FunctionId::sprintf, "SA", ValueType::string, true},
    {"bool", FunctionId::to_bool, "A", ValueType::boolean, true},
    {"integer", FunctionId::to_integer, "A", kInteger, true},
    {"real", FunctionId::to_real, "A", kReal, true},
    {"string", FunctionId::to_string, "A", ValueType::string, true},
};

/// The one conversion of a format: `%[flags][width][.precision]letter`.
struct Conversion {
  std::string text;
  char letter = 0;
};

[[noreturn]] void fail_format(const std::string& what) {
  throw EvaluationError("sprintf: " + what);
}

std::size_t read_width(const std::string& format, std::size_t at) {
  int width = 0;
  for (; is_digit(char_at(format, at)); ++at) {
    width = 10 * width + (format[at] - '0');
    if (width > 500) fail_format("width or precision above 500");
  }
  return at;
}

Conversion find_conversion(const std::string& format) {
  Conversion found;
  for (std::size_t i = 0; i < format.size(); ++i) {
    if (format[i] == '\0') fail_format("format contains a null character");
    if (format[i] != '%') continue;
    if (char_at(format, i + 1) == '%') {
      ++i;
      continue;
    }
    if (found.letter) fail_format("more than one conversion in the format");
    std::size_t end = i + 1;
    while (std::string_view("-+ #0").find(char_at(format, end)) != std::string_view::npos &&
           end < format.size())
      ++end;
    end = read_width(format, end);
    if (char_at(format, end) == '.') end = read_width(format, end + 1);
    found.letter = char_at(format, end);
    found.text = format.substr(i, end + 1 - i);
    i = end;
  }
  if (!found.letter) fail_format("no conversion in the format");
  return found;
}

template <class T>
std::string print_with(const std::string& format, T value) {
  const int n = std::snprintf(nullptr, 0, format.c_str(), value);
  std::string r(n > 0 ? n : 0, '\0');
  if (n > 0) std::snprintf(r.data(), n + 1, format.c_str(), value);
  return r;
}

}  // namespace

const Function* find_function(std::string_view name) {
  static const std::unordered_map<std::string_view, const Function*> table = [] {
    std::unordered_map<std::string_view, const Function*> t;
    for (const Function& f : kFunctions) t.emplace(f.name, &f);
    return t;
  }();
  const auto it = table.find(name);
  return it == table.end() ? nullptr : it->second;
}

std::vector<std::string> expression_function_names() {
  std::vector<std::string> names;
  for (const Function& f : kFunctions) names.emplace_back(f.name);
  return names;
}

std::string nearest_function(std::string_view name) {
  Nearest nearest(name);
  for (const Function& f : kFunctions) nearest.consider(f.name);
  return nearest.best();
}

std::string format_value(const std::string& format, const Value& value) {
  const Conversion c = find_conversion(format);
  const ValueType type = type_of(value);
  const auto suits = [&](std::string_view letters) {
    return c.letter && letters.find(c.letter) != std::string_view::npos;
  };
  if (type == ValueType::real && suits("eEfFgGaA"))
    return print_with(format, std::get<double>(value));
  if (type == ValueType::integer && suits("dioxXuc"))
    return print_with(format, std::get<std::int32_t>(value));
  if (type == ValueType::boolean && suits("dioxXuc"))
    return print_with(format, static_cast<int>(std::get<bool>(value)));
  if (type == ValueType::string && suits("s"))
    return print_with(format, std::get<std::string>(value).c_str());
  const char* article = type == ValueType::integer ? "an " : "a ";
  fail_format("format " + c.text + " does not match " + article + type_name(type) + " value");
}

}  // namespace mbcosim
