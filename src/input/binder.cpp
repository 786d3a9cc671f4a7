#include "input/binder.h"

#include <set>
#include <string_view>

#include "input/call_binder.h"
#include "input/plugin.h"
#include "input/reading.h"
#include "input/symbol_values.h"

namespace mbcosim {

namespace {

bool is_int_like(ValueType t) { return t == ValueType::boolean || t == ValueType::integer; }

constexpr std::string_view kOperatorTexts[] = {"+", "-",  "!",  "+",  "-", "*",  "/",  "%",  "^",
                                               "<", "<=", "==", ">=", ">", "!=", "&&", "||", "~|"};
std::string_view text_of(Operator op) { return kOperatorTexts[static_cast<int>(op)]; }

double number_of(const Value& v) {
  switch (type_of(v)) {
    case ValueType::boolean:
      return std::get<bool>(v);
    case ValueType::integer:
      return std::get<std::int32_t>(v);
    case ValueType::real:
      return std::get<double>(v);
    case ValueType::string:
      break;
  }
  return 0;
}

class Binder : CallBinder {
 public:
  Binder(Reading& reading, const Syntax& syntax, const BindingRules& rules, Program* program)
      : CallBinder(reading, rules.run_time, *program), syntax_(syntax), rules_(rules) {
    for (const SyntaxItem& item : syntax_.items)
      if (item.form == Form::assign) assigned_.insert(item.name);
  }

  void bind() {
    for (const SyntaxItem& item : syntax_.items) {
      item_ = &item;
      bind_item(item);
      out_.depth = std::max(out_.depth, static_cast<int>(stack_.size()));
    }
    out_.type = stack_.back().type;
  }

 private:
  void bind_item(const SyntaxItem& item) {
    switch (item.form) {
      case Form::integer:
        push_integer(item.integer);
        break;
      case Form::real:
        push_real(item.real);
        break;
      case Form::text:
        push_text(syntax_.texts[item.text]);
        break;
      case Form::name:
        load_name(item);
        break;
      case Form::call:
        call(item);
        break;
      case Form::unary:
        unary(item);
        break;
      case Form::binary:
        binary(item);
        break;
      case Form::declare:
        declare(item);
        break;
      case Form::assign:
        assign(item);
        break;
      case Form::drop:
        drop();
        break;
      case Form::plugin:
        plugin(item);
        break;
    }
  }

  // ------------------------------------------------------------------------------------------------------------
  // names
  int find_local(std::string_view name) const {
    for (std::size_t k = 0; k < local_names_.size(); ++k)
      if (local_names_[k] == name) return static_cast<int>(k);
    return -1;
  }
  int add_local(std::string_view name, ValueType type, double initial, int variable = -1) {
    local_names_.push_back(name);
    out_.locals.push_back({type, initial, variable});
    return static_cast<int>(local_names_.size()) - 1;
  }
  void load_local(int index) { load(Op::load_local, out_.locals[index].type).index = index; }

  void load_name(const SyntaxItem& item) {
    check_space(item, false);
    if (run_time_ && load_run_name(item)) return;
    Symbol* s = reading_.symbols.find(item.name);
    if (!s) fail_unknown(item);
    if (s->damaged) reading_.set_damaged(true);
    if (s->plugin) return load_drive(s->plugin);
    if (!run_time_) {
      load(Op::load_symbol, type_of(s->value)).symbol = s;
    } else if (s->role != SymbolRole::plain) {
      load_role(*s);
    } else if (s->variable >= 0) {
      load_variable(item, *s);
    } else {
      push_value(s->value);
    }
  }

  /// Names that only a run-time string knows: its own variables, arguments, captured loop
  /// variables.
  bool load_run_name(const SyntaxItem& item) {
    const int local = find_local(item.name);
    if (local >= 0) {
      load_local(local);
      return true;
    }
    if (rules_.arguments)
      for (std::size_t k = 0; k < rules_.arguments->size(); ++k)
        if ((*rules_.arguments)[k] == item.name) {
          load(Op::load_argument, ValueType::real).index = static_cast<std::int32_t>(k);
          return true;
        }
    if (!rules_.captured) return false;
    const auto captured = rules_.captured->find(item.name);
    if (captured == rules_.captured->end()) return false;
    if (captured->second.plugin)
      load_drive(captured->second.plugin);
    else
      push_value(captured->second.value);
    return true;
  }

  void load_role(const Symbol& s) {
    switch (s.role) {
      case SymbolRole::time:
        load(Op::load_time, ValueType::real);
        break;
      case SymbolRole::time_step:
        load(Op::load_time_step, ValueType::real);
        break;
      case SymbolRole::step:
        load(Op::load_step, ValueType::integer);
        break;
      case SymbolRole::var:
        load(Op::load_var, ValueType::real);
        break;
      case SymbolRole::plain:
        break;
    }
    convert(0, type_of(s.value));
  }

  /// A variable that some string assigns. A string that assigns it works on a copy that starts with
  /// the value of the last step; the others see the value of this step.
  void load_variable(const SyntaxItem& item, const Symbol& s) {
    if (assigns(item.name)) return load_local(variable_local(item, s));
    load(Op::load_variable, type_of(s.value)).index = 2 * s.variable + 1;
  }
  int variable_local(const SyntaxItem& item, const Symbol& s) {
    const int known = find_local(item.name);
    return known >= 0 ? known
                      : add_local(item.name, type_of(s.value), number_of(s.value), 2 * s.variable);
  }
  bool assigns(std::string_view name) const { return assigned_.count(name) > 0; }

  [[noreturn]] void fail_unknown(const SyntaxItem& item) const {
    if (find_function(item.name))
      fail("function " + in_quotes(item.name) + " needs arguments in parentheses", "",
           "unknown-variable");
    const std::string best = reading_.symbols.nearest(item.name);
    std::string message = "unknown variable " + in_quotes(item.name);
    if (!best.empty()) message += nearest_text(item.name, best);
    std::string hint;
    if (!reading_.model_available() && (item.name == "Time" || item.name == "TimeStep" ||
                                        item.name == "Step" || item.name == "Var"))
      hint = in_quotes(item.name) + " exists from the end of the \"initial value\" block on";
    else if (best.empty())
      hint = "declare it before it is used: `set: real " + std::string(item.name) + " = <value>;`";
    fail(message, hint, "unknown-variable");
  }

  // -----------------------------------------------------------------------------------------
  // declarations, assignment
  void declare(const SyntaxItem& item) {
    check_space(item, false);
    if (find_function(item.name))
      fail(in_quotes(item.name) + " is a function name", "", "redefinition");
    if (item.name == "const" || item.name == "ifndef")
      fail(in_quotes(item.name) + " is a word of the language", "", "redefinition");
    if (item.is_constant && !item.has_value)
      fail("constant " + in_quotes(item.name) + " needs a value");
    if (run_time_) return declare_local(item);
    Symbol* known = reading_.symbols.find(item.name);
    if (known) return redeclare(item, known);
    Symbol s;
    s.name = item.name;
    s.value = zero_of(item.type);
    s.constant = item.is_constant;
    s.where = reading_.expression_span(item.where, item.length);
    const Value* const given = given_value(item);
    if (given) s.overridden = true;
    if (!item.has_value) s.declared = given ? *given : s.value;
    if (given && !item.has_value) s.value = *given;
    Symbol& made = reading_.symbols.declare(std::move(s));
    if (given && item.has_value) {
      drop();
      push_value(*given);
    }
    if (item.has_value)
      store(item, made);
    else
      load(Op::load_symbol, item.type).symbol = &made;
  }

  /// What the user gave for the symbol, as the declared type; null: nothing.
  const Value* given_value(const SyntaxItem& item) {
    const auto found = reading_.options.symbols.find(item.name);
    if (found == reading_.options.symbols.end() || reading_.symbols.depth() > 0) return nullptr;
    Result<Value> value = as_symbol(found->second, item.type);
    if (!value)
      fail("symbol " + in_quotes(item.name) + ": " + value.error().message, value.error().reason,
           "symbol");
    given_ = *value;
    return &given_;
  }

  void redeclare(const SyntaxItem& item, Symbol* known) {
    if (item.if_undefined) {
      if (item.has_value) drop();
      load(Op::load_symbol, type_of(known->value)).symbol = known;
      return;
    }
    if (known->predefined)
      fail(in_quotes(item.name) + " is a predefined constant", "choose another name",
           "redefinition");
    const bool may_assign = reading_.options.redefine && !known->constant;
    if (!may_assign) {
      std::string message = "variable " + in_quotes(item.name) + " already declared at " +
                            reading_.place(known->where);
      if (known->where.file < 0) message = in_quotes(item.name) + " is a variable of the run";
      if (item.has_value && !known->constant)
        message += "; use \"set: " + std::string(item.name) + " = " +
                   std::string(rules_.text.substr(item.value_where, item.value_length)) + ";\"";
      fail(message, "", "redefinition");
    }
    if (!item.has_value) {
      load(Op::load_symbol, type_of(known->value)).symbol = known;
      return;
    }
    if (is_text(top_type()) && !is_text(type_of(known->value)))
      fail("a string cannot replace a number", "", "redefinition");
    known->value = zero_of(top_type());
    store(item, *known);
  }

  static Value zero_of(ValueType type) {
    switch (type) {
      case ValueType::boolean:
        return false;
      case ValueType::integer:
        return std::int32_t{0};
      case ValueType::real:
        return 0.0;
      case ValueType::string:
        return std::string();
    }
    return 0.0;
  }

  void store(const SyntaxItem& item, Symbol& s) {
    const ValueType type = type_of(s.value);
    check_assignable(type, item);
    convert(0, type, Loss::warn);
    emit(Op::store_symbol, type).symbol = &s;
  }

  void check_assignable(ValueType to, const SyntaxItem& item) {
    if (is_text(top_type()) && !is_text(to))
      throw ExpressionError(item.value_where, item.value_length,
                            std::string("cannot convert string to ") + type_name(to), kNoQuotes);
  }

  void declare_local(const SyntaxItem& item) {
    const bool known = find_local(item.name) >= 0 || reading_.symbols.find(item.name);
    if (known && item.if_undefined) {
      if (item.has_value) drop();
      return load_name(item);
    }
    if (known) fail("variable " + in_quotes(item.name) + " already declared", "", "redefinition");
    const int local = add_local(item.name, item.type, 0);
    if (item.is_constant) constant_locals_.push_back(item.name);
    if (is_text(item.type)) fail("string variables are not available in run-time strings");
    if (!item.has_value) return load_local(local);
    store_local(item, local);
  }

  void store_local(const SyntaxItem& item, int local) {
    const ValueType type = out_.locals[local].type;
    check_assignable(type, item);
    convert(0, type);
    emit(Op::store_local, type).index = local;
    stack_.back().constant = false;
  }

  void assign(const SyntaxItem& item) {
    check_space(item, false);
    if (run_time_) return assign_at_run_time(item);
    Symbol* s = reading_.symbols.find(item.name);
    if (!s) fail_undeclared(item);
    if (s->predefined) fail("cannot assign predefined constant " + in_quotes(item.name));
    if (s->plugin) fail("cannot assign plugin variable " + in_quotes(item.name));
    if (s->constant) fail("cannot assign constant " + in_quotes(item.name));
    store(item, *s);
  }

  [[noreturn]] void fail_undeclared(const SyntaxItem& item) const {
    if (find_function(item.name)) fail(in_quotes(item.name) + " is a function name");
    const std::string value(rules_.text.substr(item.value_where, item.value_length));
    fail(in_quotes(item.name) + " is not declared; write \"set: " + type_name(top_type()) + " " +
             std::string(item.name) + " = " + value + ";\"",
         "", "unknown-variable");
  }

  void assign_at_run_time(const SyntaxItem& item) {
    int local = find_local(item.name);
    for (const std::string_view c : constant_locals_)
      if (c == item.name) fail("cannot assign constant " + in_quotes(item.name));
    if (local < 0) local = local_for_assignment(item);
    store_local(item, local);
  }

  int local_for_assignment(const SyntaxItem& item) {
    if (rules_.captured) {
      const auto captured = rules_.captured->find(item.name);
      if (captured != rules_.captured->end()) {
        if (captured->second.plugin) fail("cannot assign plugin variable " + in_quotes(item.name));
        return add_local(item.name, type_of(captured->second.value),
                         number_of(captured->second.value));
      }
    }
    const Symbol* s = reading_.symbols.find(item.name);
    if (!s) fail_undeclared(item);
    if (s->role != SymbolRole::plain)
      fail("cannot assign " + in_quotes(item.name) + ", which the run sets");
    if (s->plugin) fail("cannot assign plugin variable " + in_quotes(item.name));
    if (s->constant)
      fail("cannot assign " + std::string(s->predefined ? "predefined " : "") + "constant " +
           in_quotes(item.name));
    if (is_text(type_of(s->value))) fail("string variables cannot be assigned in run-time strings");
    return add_local(item.name, type_of(s->value), number_of(s->value),
                     s->variable >= 0 ? 2 * s->variable : -1);
  }

  void drop() {
    emit(Op::drop, stack_.back().type).from = stack_.back().type;
    const Entry e = stack_.back();
    stack_.pop_back();
    // Code that computes a constant for nobody; a drop of anything else must stay for what its code
    // does.
    if (run_time_ && e.constant) out_.code.resize(e.start);
  }

  void plugin(const SyntaxItem& item) {
    if (run_time_)
      fail("plugin variables are declared by the deck, not inside a run-time string",
           "use a set card before");
    load_drive(declare_plugin(reading_, item.name, item.where + 1).plugin);
  }

  // --------------------------------------------------------------------------------------------------------
  // operators
  void unary(const SyntaxItem& item) {
    const ValueType t = top_type();
    switch (item.op) {
      case Operator::plus:
        return;
      case Operator::minus:
        if (is_text(t)) fail("operator - is not defined for strings");
        if (is_real(t))
          reduce(1, Op::negate_real, ValueType::real);
        else
          reduce(1, Op::negate_integer, ValueType::integer);
        return fold();
      default:
        reduce(1,
               is_text(t)   ? Op::not_text
               : is_real(t) ? Op::not_real
                            : Op::not_integer,
               ValueType::boolean);
        return fold();
    }
  }

  void binary(const SyntaxItem& item) {
    const ValueType left = top_type(1), right = top_type();
    if (item.op == Operator::add && is_text(left)) {
      reduce(2, Op::concatenate, ValueType::string).from = right;
      return fold();
    }
    if (is_text(left) || is_text(right)) fail_text_operand(item.op);
    const bool int_like = is_int_like(left) && is_int_like(right);
    switch (item.op) {
      case Operator::add:
      case Operator::subtract:
      case Operator::multiply:
      case Operator::divide:
        arithmetic(item.op, int_like, left);
        break;
      case Operator::modulo:
        modulo(left, right);
        break;
      case Operator::power:
        power(left, right);
        break;
      default:
        comparison(item.op);
        break;
    }
    fold();
  }

  [[noreturn]] void fail_text_operand(Operator op) const {
    if (op == Operator::add)
      fail("operator +: the right operand is a string and the left one is not", "write \"\" + ...");
    fail("operator " + std::string(text_of(op)) + " is not defined for strings");
  }

  void arithmetic(Operator op, bool int_like, ValueType left) {
    const int k = static_cast<int>(op) - static_cast<int>(Operator::add);
    if (int_like) {
      reduce(2, static_cast<Op>(static_cast<int>(Op::add_integer) + k), left);
    } else {
      both_real();
      reduce(2, static_cast<Op>(static_cast<int>(Op::add_real) + k), ValueType::real);
    }
  }

  void both_real() {
    convert(1, ValueType::real);
    convert(0, ValueType::real);
  }

  void modulo(ValueType left, ValueType right) {
    if (is_real(left)) fail("operands of % must be integers; left operand is real");
    if (is_real(right)) fail("operands of % must be integers; right operand is real");
    reduce(2, Op::modulo, ValueType::integer);
  }

  void power(ValueType left, ValueType right) {
    if (left == ValueType::integer && right == ValueType::integer) {
      reduce(2, Op::power_integer, ValueType::integer);
    } else {
      both_real();
      reduce(2, Op::power_real, ValueType::real);
    }
  }

  void comparison(Operator op) {
    both_real();
    const int k = static_cast<int>(op) - static_cast<int>(Operator::less);
    reduce(2, static_cast<Op>(static_cast<int>(Op::less) + k), ValueType::boolean);
  }

  const Syntax& syntax_;
  std::set<std::string_view> assigned_;
  const BindingRules& rules_;
  std::vector<std::string_view> local_names_;
  std::vector<std::string_view> constant_locals_;
  Value given_;
};

}  // namespace

void bind(Reading& reading, const Syntax& syntax, const BindingRules& rules, Program* program) {
  program->clear();
  Binder(reading, syntax, rules, program).bind();
}

}  // namespace mbcosim
