/// Expressions as text in reverse order of operations (operands first), before names have a
/// meaning.
#pragma once

#include <cstdint>
#include <deque>
#include <string>
#include <string_view>
#include <vector>

#include "input/value.h"
#include "model/diagnostic.h"
#include "model/limits.h"

namespace mbcosim {

/// What is wrong in an expression, with its place in the expression's text.
class ExpressionError : public EvaluationError {
 public:
  ExpressionError(std::size_t where, std::size_t length, const std::string& message,
                  std::string hint = "", std::string code = "expression")
      : EvaluationError(message),
        where(where),
        length(length),
        hint(std::move(hint)),
        code(std::move(code)) {}
  std::size_t where, length;
  std::string hint, code;
};

/// What to do about a string where a number is wanted.
inline constexpr const char* kNoQuotes = "write a value of this type, without quotes";

/// A piece of an expression as messages show it.
inline std::string in_quotes(std::string_view s) { return '"' + std::string(s) + '"'; }

enum class Form : std::uint8_t {
  integer,
  real,
  text,  ///< literals
  name,  ///< value of a variable
  call,  ///< function with `count` arguments
  unary,
  binary,   ///< `op`
  declare,  ///< `type name [= value]`
  assign,   ///< `name = value`
  drop,     ///< `;`: forgets the value
  plugin,   ///< `[...]`, name is the inside
};

enum class Operator : std::uint8_t {
  plus,
  minus,
  negate,
  add,
  subtract,
  multiply,
  divide,
  modulo,
  power,
  less,
  less_equal,
  equal,
  greater_equal,
  greater,
  not_equal,
  logical_and,
  logical_or,
  logical_xor
};

struct SyntaxItem {
  Form form = Form::integer;
  Operator op = Operator::plus;
  ValueType type = ValueType::integer;                                ///< of a declaration
  bool is_constant = false, if_undefined = false, has_value = false;  ///< of a declaration
  int count = 0;
  std::uint32_t where = 0, length = 0;  ///< place in the text
  std::uint32_t value_where = 0,
                value_length = 0;  ///< right-hand side of a declaration or assignment
  union {
    double real;
    std::int32_t integer;
    std::uint32_t text;  ///< index in Syntax::texts
  };
  std::string_view name, name_space;  ///< views into the text

  SyntaxItem() : real(0) {}
};

/// Items are left to right in the order of evaluation: nothing is skipped and nothing repeats.
struct Syntax {
  std::vector<SyntaxItem> items;
  std::deque<std::string> texts;     ///< decoded literals
  std::vector<SyntaxItem> declared;  ///< heads of declarations, also when what follows is wrong

  void clear() {
    items.clear();
    texts.clear();
    declared.clear();
  }
};

/// Parses one argument of a card from `begin` on: one statement, ended by `,` or the end of the
/// text. Returns where it ends. Throws ExpressionError.
std::size_t parse_argument(std::string_view text, std::size_t begin, const Limits& limits,
                           Syntax* syntax);
/// Parses a run-time string: statements separated by `;`, to the end of the text.
void parse_string(std::string_view text, const Limits& limits, Syntax* syntax);

/// The type with this name in expressions; false when there is none.
bool find_type(std::string_view name, ValueType* type);

}  // namespace mbcosim
