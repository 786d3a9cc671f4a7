#include "input/binder.h"

#include "input/model_functions.h"
#include "input/nearest.h"
#include "input/plugin.h"
#include "input/session.h"
#include "model/drive.h"
#include "model/model.h"

namespace mbcosim {

namespace {

std::string in_quotes(std::string_view s) { return '"' + std::string(s) + '"'; }
bool is_int_like(ValueType t) { return t == ValueType::boolean || t == ValueType::integer; }
bool is_real(ValueType t) { return t == ValueType::real; }
bool is_text(ValueType t) { return t == ValueType::string; }

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

class Binder {
 public:
  Binder(Session& session, const Syntax& syntax, const BindingRules& rules, Program* program)
      : session_(session), syntax_(syntax), rules_(rules), out_(*program) {}

  void bind() {
    for (const SyntaxItem& item : syntax_.items) {
      item_ = &item;
      bind_item(item);
      out_.depth = std::max(out_.depth, static_cast<int>(stack_.size()));
    }
    out_.type = stack_.back().type;
  }

 private:
  /// A value on the stack: its type, and where the code that makes it begins.
  struct Entry {
    ValueType type;
    std::uint32_t start;
    bool constant;
  };

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

  // -------------------------------------------------------------------------------------------------------------
  // code
  [[noreturn]] void fail(const std::string& message, const std::string& hint = "",
                         const std::string& code = "expression") const {
    throw ExpressionError(item_->where, item_->length, message, hint, code);
  }

  Instruction& emit(Op op, ValueType type) {
    Instruction& in = out_.code.emplace_back();
    in.op = op;
    in.type = type;
    in.where = item_->where;
    in.length = item_->length;
    return in;
  }
  std::uint32_t here() const { return static_cast<std::uint32_t>(out_.code.size()); }
  void pushed(ValueType type, std::uint32_t start, bool constant) {
    stack_.push_back({type, start, constant});
  }

  Instruction& load(Op op, ValueType type) {
    pushed(type, here(), false);
    return emit(op, type);
  }
  void push_integer(std::int32_t value, ValueType type = ValueType::integer) {
    pushed(type, here(), true);
    emit(Op::push, type).integer = value;
  }
  void push_real(double value) {
    pushed(ValueType::real, here(), true);
    emit(Op::push, ValueType::real).real = value;
  }
  void push_text(const std::string& value) {
    pushed(ValueType::string, here(), true);
    emit(Op::push_text, ValueType::string).index = static_cast<std::int32_t>(out_.texts.size());
    out_.texts.push_back(value);
  }
  void push_value(const Value& v) {
    switch (type_of(v)) {
      case ValueType::boolean:
        push_integer(std::get<bool>(v), ValueType::boolean);
        break;
      case ValueType::integer:
        push_integer(std::get<std::int32_t>(v));
        break;
      case ValueType::real:
        push_real(std::get<double>(v));
        break;
      case ValueType::string:
        push_text(std::get<std::string>(v));
        break;
    }
  }
  void load_drive(const DrivePtr& drive) {
    load(Op::load_drive, ValueType::real).index = static_cast<std::int32_t>(out_.drives.size());
    out_.drives.push_back(drive);
  }

  /// Where the code of the value `depth` below the top ends.
  std::uint32_t code_end(int depth) const {
    return depth == 0 ? here() : stack_[stack_.size() - depth].start;
  }
  ValueType top_type(int depth = 0) const { return stack_[stack_.size() - 1 - depth].type; }

  void convert(int depth, ValueType to, Loss loss = Loss::silent) {
    Entry& e = stack_[stack_.size() - 1 - depth];
    if (e.type == to) return;
    if (is_text(e.type)) fail(std::string("cannot convert string to ") + type_name(to));
    if (to == ValueType::integer && e.type == ValueType::boolean) {
      e.type = to;
      return;
    }
    Instruction& first = out_.code[e.start];
    if (to == ValueType::real && first.op == Op::push && first.type == e.type &&
        code_end(depth) == e.start + 1) {
      first.type = e.type = to;  // a literal
      first.real = first.integer;
      return;
    }
    Instruction& in = emit(Op::convert, to);
    in.from = e.type;
    in.depth = static_cast<std::uint8_t>(depth);
    in.loss = loss;
    e.type = to;
  }

  /// Replaces the `count` topmost values by the one that `op` makes of them.
  Instruction& reduce(int count, Op op, ValueType type) {
    const std::uint32_t start = count ? stack_[stack_.size() - count].start : here();
    bool constant = true;
    for (int k = 0; k < count; ++k) constant = constant && stack_[stack_.size() - 1 - k].constant;
    stack_.resize(stack_.size() - count);
    pushed(type, start, constant);
    return emit(op, type);
  }

  /// Run-time strings: computes now what does not depend on anything.
  void fold() {
    const Entry e = stack_.back();
    if (!rules_.run_time || !e.constant) return;
    Program part;
    part.code.assign(out_.code.begin() + e.start, out_.code.end());
    part.texts = out_.texts;
    part.depth = static_cast<int>(part.code.size()) + 1;
    Frame<double> frame;
    frame.context = &session_.context();
    Slot<double> result;
    try {
      result = run(part, frame);
    } catch (const EvaluationError&) {
      stack_.back().constant = false;  // fails when it is evaluated, if ever
      return;
    }
    out_.code.resize(e.start);
    stack_.pop_back();
    if (is_text(e.type))
      push_text(frame.texts.back());
    else if (is_real(e.type))
      push_real(result.r);
    else
      push_integer(result.i, e.type);
  }

  // ------------------------------------------------------------------------------------------------------------
  // names
  void check_space(const SyntaxItem& item, bool is_function) const {
    if (item.name_space.empty() || item.name_space == "default") return;
    if (item.name_space != "model")
      fail("unknown namespace " + in_quotes(item.name_space),
           "the namespaces are default and model");
    if (!is_function)
      fail("namespace model has no variables", "model:: functions need parentheses");
  }

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
    if (rules_.run_time && load_run_name(item)) return;
    Symbol* s = session_.symbols.find(item.name);
    if (!s) fail_unknown(item);
    if (s->damaged) session_.set_damaged(true);
    if (s->plugin) return load_drive(s->plugin);
    if (!rules_.run_time) {
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
  bool assigns(std::string_view name) const {
    for (const SyntaxItem& i : syntax_.items)
      if (i.form == Form::assign && i.name == name) return true;
    return false;
  }

  [[noreturn]] void fail_unknown(const SyntaxItem& item) const {
    if (find_function(item.name))
      fail("function " + in_quotes(item.name) + " needs arguments in parentheses", "",
           "unknown-variable");
    const std::string best = session_.symbols.nearest(item.name);
    std::string message = "unknown variable " + in_quotes(item.name);
    if (!best.empty()) message += nearest_text(item.name, best);
    std::string hint;
    if (!session_.model_available() && (item.name == "Time" || item.name == "TimeStep" ||
                                        item.name == "Step" || item.name == "Var"))
      hint = in_quotes(item.name) + " exists from the end of the \"initial value\" block on";
    fail(message, hint, "unknown-variable");
  }

  static std::string nearest_text(std::string_view name, const std::string& best) {
    const bool case_only = Nearest(name).is_case_of(best);
    return (case_only ? "; names are case sensitive; did you mean " : "; did you mean ") +
           in_quotes(best) + "?";
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
    if (rules_.run_time) return declare_local(item);
    Symbol* known = session_.symbols.find(item.name);
    if (known) return redeclare(item, known);
    Symbol s;
    s.name = item.name;
    s.value = zero_of(item.type);
    s.constant = item.is_constant;
    s.where = session_.expression_span(item.where, item.length);
    Symbol& made = session_.symbols.declare(std::move(s));
    if (item.has_value)
      store(item, made);
    else
      load(Op::load_symbol, item.type).symbol = &made;
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
    const bool may_assign = session_.options.redefine && !known->constant;
    if (!may_assign) {
      std::string message = "variable " + in_quotes(item.name) + " already declared at " +
                            session_.place(known->where);
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
                            std::string("cannot convert string to ") + type_name(to));
  }

  void declare_local(const SyntaxItem& item) {
    const bool known = find_local(item.name) >= 0 || session_.symbols.find(item.name);
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
    if (rules_.run_time) return assign_at_run_time(item);
    Symbol* s = session_.symbols.find(item.name);
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
    const Symbol* s = session_.symbols.find(item.name);
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
    if (rules_.run_time && e.constant) out_.code.resize(e.start);
  }

  void plugin(const SyntaxItem& item) {
    if (rules_.run_time)
      fail("plugin variables are declared by the deck, not inside a run-time string",
           "use a set card before");
    load_drive(declare_plugin(session_, item.name, item.where + 1).plugin);
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

  // --------------------------------------------------------------------------------------------------------
  // functions
  void call(const SyntaxItem& item) {
    check_space(item, true);
    if (item.name_space == "model") return model_call(item);
    const Function* f = find_function(item.name);
    if (!f) fail_unknown_function(item, nearest_function(item.name));
    const int expected = static_cast<int>(std::string_view(f->arguments).size());
    check_count(item, item.name, expected, expected);
    if (f->id == FunctionId::sprintf) return call_format();
    if (f->id >= FunctionId::to_bool) return call_conversion(f->result);
    for (int k = 0; k < expected; ++k) convert_argument(item.name, k, expected, f->arguments[k]);
    Instruction& in = reduce(expected, Op::call, f->result);
    in.function = f->id;
    in.count = static_cast<std::uint8_t>(expected);
    if (!f->pure) stack_.back().constant = false;
    fold();
  }

  [[noreturn]] void fail_unknown_function(const SyntaxItem& item, const std::string& best) const {
    std::string message = "unknown function " + in_quotes(item.name);
    if (!best.empty()) message += nearest_text(item.name, best);
    fail(message, "", "unknown-function");
  }

  void check_count(const SyntaxItem& item, std::string_view name, int least, int most) const {
    if (item.count >= least && item.count <= most) return;
    std::string expected = std::to_string(least);
    if (most > least) expected += " or " + std::to_string(most);
    fail("function " + std::string(name) + " expects " + expected +
         (most == 1 ? " argument, " : " arguments, ") + std::to_string(item.count) + " given");
  }

  void convert_argument(std::string_view name, int k, int count, char kind) {
    const int depth = count - 1 - k;
    const ValueType t = top_type(depth);
    if ((kind == 'S') != is_text(t)) {
      const char* wanted = kind == 'S' ? " must be a string" : " must be a number, string found";
      fail(std::string(name) + ": argument " + std::to_string(k + 1) + wanted);
    }
    if (kind == 'R') convert(depth, ValueType::real);
    if (kind == 'I') convert(depth, ValueType::integer);
  }

  void call_format() {
    if (!is_text(top_type(1))) fail("sprintf: argument 1 must be a string");
    const ValueType from = top_type();
    reduce(2, Op::format, ValueType::string).from = from;
    fold();
  }

  void call_conversion(ValueType to) {
    convert(0, to);
    fold();
  }

  // ----------------------------------------------------------------------------------------------------------
  // model::
  void model_call(const SyntaxItem& item) {
    if (!session_.model_available())
      fail("model::" + std::string(item.name) +
           " is not available before the end of the \"initial value\" block");
    const std::size_t colons = item.name.find("::");
    if (colons != std::string_view::npos) {
      const std::string_view space = item.name.substr(0, colons),
                             name = item.name.substr(colons + 2);
      if (space == "sf") return call_scalar_function(item, name);
      if (space == "node") return call_node_datum(item, name);
      if (space == "element") return call_element_datum(item, name);
      fail("unknown namespace \"model::" + std::string(space) + '"',
           "there are model::sf, model::node and model::element");
    }
    if (item.name == "current") return call_current(item);
    if (item.name == "drive" || item.name == "drivep") return call_drive(item);
    NodeFunction f;
    if (!find_node_function(item.name, &f))
      fail_unknown_function(item, nearest_model_function(item.name));
    check_count(item, item.name, f.nodes(), f.nodes());
    for (int k = 0; k < f.nodes(); ++k) convert_argument(item.name, k, f.nodes(), 'I');
    reduce_model(f.nodes(), Op::node_function).index = f.code();
  }

  Instruction& reduce_model(int count, Op op) {
    Instruction& in = reduce(count, op, ValueType::real);
    in.count = static_cast<std::uint8_t>(count);
    stack_.back().constant = false;
    return in;
  }

  void call_drive(const SyntaxItem& item) {
    check_count(item, item.name, 2, 2);
    convert_argument(item.name, 0, 2, 'I');
    convert_argument(item.name, 1, 2, 'R');
    reduce_model(2, item.name == "drive" ? Op::drive_value : Op::drive_derivative);
  }

  void call_current(const SyntaxItem& item) {
    check_count(item, "current", 1, 1);
    if (!is_text(top_type()) || out_.code.back().op != Op::push_text)
      fail("current: the argument must be a string");
    const std::string name = out_.texts[out_.code.back().index];
    const auto value = session_.currents.find(name);
    if (value == session_.currents.end())
      fail("no value \"" + name + "\" is supplied by the card being read");
    out_.code.pop_back();
    stack_.pop_back();
    push_real(value->second);
  }

  void call_scalar_function(const SyntaxItem& item, std::string_view name) {
    check_count(item, item.name, 1, 2);
    const auto f = session_.functions.find(name);
    if (f == session_.functions.end())
      fail("scalar function " + in_quotes(name) + " is not defined");
    convert_argument(item.name, 0, item.count, 'R');
    if (item.count == 2) convert_argument(item.name, 1, 2, 'I');
    reduce_model(item.count, Op::function_value).index =
        static_cast<std::int32_t>(out_.functions.size());
    out_.functions.push_back(f->second);
  }

  void call_node_datum(const SyntaxItem& item, std::string_view name) {
    const int type = node_type(name);
    if (type < 0)
      fail("unknown node type " + in_quotes(name),
           "structural, abstract, electric, hydraulic, thermal or parameter");
    check_count(item, item.name, 2, 2);
    call_datum(item, Op::node_datum, type);
  }

  void call_element_datum(const SyntaxItem& item, std::string_view name) {
    Family family;
    if (!family_of(name, &family)) fail("unknown element type " + in_quotes(name));
    check_count(item, item.name, 1, 2);
    call_datum(item, Op::element_datum, static_cast<int>(family));
  }

  void call_datum(const SyntaxItem& item, Op op, int index) {
    if (item.count == 2) convert_argument(item.name, 0, 2, 'I');
    convert_argument(item.name, item.count - 1, item.count, 'S');
    if (rules_.run_time && bind_datum(item.count, op, index)) return;
    reduce_model(item.count, op).index = index;
  }

  /// Label and datum known: looked up once.
  bool bind_datum(int count, Op op, int index) {
    const Entry& text = stack_.back();
    const Entry& first = stack_[stack_.size() - count];
    if (!text.constant || !first.constant || !session_.builder()) return false;
    const std::string name = out_.texts[out_.code[text.start].index];
    const int label = count == 2 ? out_.code[first.start].integer : 0;
    const Model& model = session_.builder()->model();
    DrivePtr drive;
    try {
      drive = op == Op::node_datum
                  ? node_datum(model, index, label, name)
                  : element_datum(model, static_cast<Family>(index), count == 2, label, name);
    } catch (const ExpressionError&) {
      throw;
    } catch (const EvaluationError& e) {
      fail(e.what());
    }
    out_.code.resize(first.start);
    stack_.resize(stack_.size() - count);
    load_drive(drive);
    return true;
  }

  Session& session_;
  const Syntax& syntax_;
  const BindingRules& rules_;
  Program& out_;
  const SyntaxItem* item_ = nullptr;
  std::vector<Entry> stack_;
  std::vector<std::string_view> local_names_;
  std::vector<std::string_view> constant_locals_;
};

}  // namespace

void bind(Session& session, const Syntax& syntax, const BindingRules& rules, Program* program) {
  program->clear();
  Binder(session, syntax, rules, program).bind();
}

}  // namespace mbcosim
