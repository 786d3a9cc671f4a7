#include "input/symbol_values.h"

#include <charconv>
#include <cmath>
#include <limits>

#include "input/lexer.h"
#include "input/reading.h"

namespace mbcosim {

namespace {

Error misfit(std::string message, std::string hint) {
  return make_error(ErrorKind::argument, std::move(hint), std::move(message));
}

std::string shown(const Value& v) {
  if (const auto* number = std::get_if<double>(&v)) return "the number " + number_text(*number);
  if (const auto* flag = std::get_if<bool>(&v)) return *flag ? "TRUE" : "FALSE";
  return type_of(v) == ValueType::integer ? "the number " + printed(v) : "the string " + printed(v);
}

Result<Value> as_integer(const Value& given, double number) {
  constexpr auto kLimits = std::numeric_limits<std::int32_t>();
  if (number != std::floor(number) || number < kLimits.min() || number > kLimits.max())
    return misfit("the deck declares an integer, " + shown(given) + " was given",
                  "give a whole number of 32 bits");
  return Value(static_cast<std::int32_t>(number));
}

std::string why_unreached(const Reading& reading, const std::string& name) {
  const Symbol* s = reading.symbols.find(name);
  if (!s) return "the deck declares no variable of this name at outer level";
  if (s->predefined) return "it is a predefined constant";
  if (s->plugin) return "it is a plugin variable, whose value comes from the model";
  return "it is a variable of the run";
}

/// The deck's own symbols that are near.
std::string nearest_own(const Reading& reading, const std::string& name) {
  const std::string best = reading.symbols.nearest(name);
  const Symbol* s = best.empty() ? nullptr : reading.symbols.find(best);
  return s && s->declared && !s->predefined ? best : "";
}

Value value_of_text(std::string_view text) {
  if (text == "TRUE" || text == "true") return true;
  if (text == "FALSE" || text == "false") return false;
  if (text.size() > 1 && text.front() == '"' && text.back() == '"')
    return std::string(text.substr(1, text.size() - 2));
  const std::string_view digits = text.starts_with('+') ? text.substr(1) : text;
  double number = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), number);
  if (error == std::errc() && end == digits.data() + digits.size() && std::isfinite(number))
    return number;
  return std::string(text);
}

}  // namespace

Result<Value> as_symbol(const Value& given, ValueType type) {
  if (type_of(given) == type) {
    const auto* real = std::get_if<double>(&given);
    if (real && !std::isfinite(*real))
      return misfit("the value is not finite", "give a finite number");
    return given;
  }
  const bool is_number = type_of(given) == ValueType::real || type_of(given) == ValueType::integer;
  const auto* real = std::get_if<double>(&given);
  const double number = real ? *real : is_number ? std::get<std::int32_t>(given) : 0;
  switch (type) {
    case ValueType::boolean:
      return misfit("the deck declares a bool, " + shown(given) + " was given",
                    "give TRUE or FALSE");
    case ValueType::integer:
      if (is_number) return as_integer(given, number);
      return misfit("the deck declares an integer, " + shown(given) + " was given",
                    "give a whole number");
    case ValueType::real:
      if (is_number) return Value(number);
      return misfit("the deck declares a real, " + shown(given) + " was given", "give a number");
    case ValueType::string:
      break;
  }
  return misfit("the deck declares a string, " + shown(given) + " was given",
                "give a string; on the command line in quotes of its own: 'NAME=\"text\"'");
}

std::vector<Diagnostic> unreached_symbols(const Reading& reading) {
  std::vector<Diagnostic> found;
  for (const auto& [name, value] : reading.options.symbols) {
    const Symbol* s = reading.symbols.find(name);
    if (s && s->overridden) continue;
    Diagnostic d;
    d.code = "symbol";
    d.file = reading.file(0).name;
    d.message = "symbol \"" + name + "\" cannot be given: " + why_unreached(reading, name);
    const std::string near = nearest_own(reading, name);
    d.hint = !near.empty() && near != name
                 ? "did you mean \"" + near + "\"?"
                 : "only symbols that the deck declares outside loops can be given; `describe` "
                   "lists them";
    found.push_back(std::move(d));
  }
  return found;
}

Result<std::pair<std::string, Value>> parse_symbol(std::string_view text) {
  const std::size_t equal = text.find('=');
  const std::string_view name = text.substr(0, equal);
  if (equal == std::string_view::npos || name.empty() || !is_word_start(name[0]) ||
      skip_identifier(name, 0) != name.size())
    return misfit("\"" + std::string(text.substr(0, 100)) + "\" is not of the form NAME=VALUE", "");
  return std::pair(std::string(name), value_of_text(text.substr(equal + 1)));
}

std::string exact_text(const SymbolValues& values) {
  std::string text;
  for (const auto& [name, value] : values) {
    char number[32];
    if (const auto* real = std::get_if<double>(&value)) std::snprintf(number, 32, "%a", *real);
    text += name + (std::holds_alternative<double>(value) ? number : printed(value)) + '\n';
  }
  return text;
}

}  // namespace mbcosim
