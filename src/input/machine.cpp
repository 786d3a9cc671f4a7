#include <cmath>
#include <limits>

#include "input/function_values.h"
#include "input/model_functions.h"
#include "input/program.h"
#include "input/reading.h"
#include "input/syntax.h"
#include "math/hash.h"
#include "model/drive.h"
#include "model/nested_evaluation.h"
#include "model/scalar_function.h"
#include "model/state.h"

namespace mbcosim {

void Program::clear() {
  code.clear();
  texts.clear();
  drives.clear();
  functions.clear();
  locals.clear();
  depth = 0;
}

namespace {

constexpr int kSmallStack = 24;
constexpr int kSmallLocals = 8;

std::int32_t wrap(std::int64_t x) {
  return static_cast<std::int32_t>(static_cast<std::uint32_t>(x));
}

std::int32_t integer_power(std::int32_t x, std::int32_t y) {
  if (x < 0 && y <= 0) throw EvaluationError("negative base with non-positive exponent");
  if (y < 0) return 0;
  std::uint32_t base = static_cast<std::uint32_t>(x), result = 1;
  for (; y > 0; y >>= 1) {
    if (y & 1) result *= base;
    base *= base;
  }
  return static_cast<std::int32_t>(result);
}

/// A uniform 31-bit number from the key of the string, the step and the count of calls in this
/// evaluation: the same for all iterations of a step, on every machine.
std::int32_t hashed_random(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15u;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return static_cast<std::int32_t>((x ^ (x >> 31)) >> 33);
}

std::string exponent_text(double v) {
  char buffer[48];
  std::snprintf(buffer, sizeof buffer, "%e", v);
  return buffer;
}

template <class T>
class Machine {
 public:
  Machine(const Program& program, Frame<T>& frame, Slot<T>* stack, Slot<T>* locals)
      : program_(program), frame_(frame), base_(stack), locals_(locals) {}

  Slot<T> run() {
    top_ = base_ - 1;
    for (const Instruction& in : program_.code) {
      try {
        execute(in);
      } catch (const ExpressionError&) {
        throw;
      } catch (const EvaluationError& e) {
        throw ExpressionError(
            in.where, in.length, e.what(),
            "check the values that enter here: `remark: \"value\", <variable>;` prints them",
            "evaluation");
      }
    }
    return *top_;
  }

 private:
  void execute(const Instruction& in) {
    switch (in.op) {
      case Op::push:
        push(in);
        break;
      case Op::push_text:
        ++top_;
        frame_.texts.push_back(program_.texts[in.index]);
        break;
      case Op::load_symbol:
        load(*in.symbol);
        break;
      case Op::store_symbol:
        store(in);
        break;
      case Op::load_local:
        *++top_ = locals_[in.index];
        break;
      case Op::store_local:
        locals_[in.index] = *top_;
        break;
      case Op::load_argument:
        (++top_)->r = frame_.arguments[in.index];
        break;
      case Op::load_variable:
        load_number(in.type, state().variables.at(in.index));
        break;
      case Op::load_time:
        (++top_)->r = T(frame_.context->time);
        break;
      case Op::load_time_step:
        (++top_)->r = T(frame_.context->h);
        break;
      case Op::load_step:
        (++top_)->i = wrap(state().step);
        break;
      case Op::load_var:
        (++top_)->r = frame_.var;
        break;
      case Op::load_drive:
        (++top_)->r = frame_.drives ? frame_.drives[in.index]
                                    : T(program_.drives[in.index]->value(*frame_.context));
        break;
      case Op::convert:
        convert(in);
        break;
      case Op::drop:
        if (in.from == ValueType::string) frame_.texts.pop_back();
        --top_;
        break;
      case Op::negate_integer:
        top_->i = wrap(-static_cast<std::int64_t>(top_->i));
        break;
      case Op::negate_real:
        top_->r = -top_->r;
        break;
      case Op::not_integer:
        top_->i = top_->i == 0;
        break;
      case Op::not_real:
        top_->i = value_of(top_->r) == 0;
        break;
      case Op::not_text:
        top_->i = pop_text().empty();
        break;
      case Op::add_real:
        --top_;
        top_->r += top_[1].r;
        break;
      case Op::subtract_real:
        --top_;
        top_->r -= top_[1].r;
        break;
      case Op::multiply_real:
        --top_;
        top_->r *= top_[1].r;
        break;
      case Op::divide_real:
        divide_real();
        break;
      case Op::power_real:
        --top_;
        top_->r = power<T>(top_->r, top_[1].r);
        break;
      case Op::less:
        compare(in.op);
        break;
      case Op::less_equal:
        compare(in.op);
        break;
      case Op::equal:
        compare(in.op);
        break;
      case Op::greater_equal:
        compare(in.op);
        break;
      case Op::greater:
        compare(in.op);
        break;
      case Op::not_equal:
        compare(in.op);
        break;
      case Op::logical_and:
      case Op::logical_or:
      case Op::logical_xor:
        logic(in.op);
        break;
      case Op::concatenate:
        concatenate(in);
        break;
      case Op::call:
        call(in);
        break;
      case Op::format:
        format(in);
        break;
      case Op::drive_value:
      case Op::drive_derivative:
        --top_;
        top_->r = T(evaluate_drive(*frame_.context, top_->i, value_of(top_[1].r),
                                   in.op == Op::drive_derivative));
        break;
      case Op::function_value:
        scalar_function(in);
        break;
      case Op::node_function:
        node_function(in);
        break;
      case Op::node_datum:
      case Op::element_datum:
        datum(in);
        break;
      default:
        integer_operation(in);
        break;
    }
  }

  const State& state() const {
    if (!frame_.context->state) throw EvaluationError("there is no state here");
    return *frame_.context->state;
  }

  void push(const Instruction& in) {
    ++top_;
    if (in.type == ValueType::real)
      top_->r = T(in.real);
    else
      top_->i = in.integer;
  }

  void load_number(ValueType type, double value) {
    ++top_;
    if (type == ValueType::real)
      top_->r = T(value);
    else
      top_->i = static_cast<std::int32_t>(value);
  }

  void load(const Symbol& s) {
    ++top_;
    switch (type_of(s.value)) {
      case ValueType::boolean:
        top_->i = std::get<bool>(s.value);
        break;
      case ValueType::integer:
        top_->i = std::get<std::int32_t>(s.value);
        break;
      case ValueType::real:
        top_->r = T(std::get<double>(s.value));
        break;
      case ValueType::string:
        frame_.texts.push_back(std::get<std::string>(s.value));
        break;
    }
  }

  void store(const Instruction& in) {
    Value& v = in.symbol->value;
    switch (in.type) {
      case ValueType::boolean:
        v = top_->i != 0;
        break;
      case ValueType::integer:
        v = top_->i;
        break;
      case ValueType::real:
        v = value_of(top_->r);
        break;
      case ValueType::string:
        v = frame_.texts.back();
        break;
    }
    if (!in.symbol->declared) in.symbol->declared = v;
    in.symbol->damaged = frame_.reading && frame_.reading->is_damaged();
  }

  std::string pop_text() {
    std::string s = std::move(frame_.texts.back());
    frame_.texts.pop_back();
    return s;
  }

  // ------------------------------------------------------------------------------------------------------
  // conversions
  void warn(const Instruction& in, const std::string& message) {
    if (in.loss == Loss::warn && frame_.reading)
      frame_.reading->warn_in_expression(in.where, in.length, message);
  }

  void convert(const Instruction& in) {
    Slot<T>& s = top_[-static_cast<int>(in.depth)];
    switch (in.type) {
      case ValueType::boolean:
        to_boolean(in, s);
        break;
      case ValueType::integer:
        to_integer(in, s);
        break;
      case ValueType::real:
        s.r = T(static_cast<double>(s.i));
        break;
      case ValueType::string:
        frame_.texts.push_back(text_of(in.from));
        break;
    }
  }

  void to_boolean(const Instruction& in, Slot<T>& s) {
    const double v = in.from == ValueType::real ? value_of(s.r) : s.i;
    if (v != 0 && v != 1) warn(in, number_text(v) + " converted to bool 1");
    s.i = v != 0;
  }

  void to_integer(const Instruction& in, Slot<T>& s) {
    if (in.from != ValueType::real) return;
    const double v = value_of(s.r), truncated = std::trunc(v);
    if (!(truncated >= std::numeric_limits<std::int32_t>::min() &&
          truncated <= std::numeric_limits<std::int32_t>::max()))
      throw EvaluationError("real " + number_text(v) + " is out of the range of integers");
    s.i = static_cast<std::int32_t>(truncated);
    if (v == truncated)
      warn(in, "real " + number_text(v) + " converted to integer");
    else
      warn(in, number_text(v) + " truncated to " + std::to_string(s.i));
  }

  /// Text of the value at the top, which is no text.
  std::string text_of(ValueType type) const {
    return type == ValueType::real ? exponent_text(value_of(top_->r)) : std::to_string(top_->i);
  }

  void concatenate(const Instruction& in) {
    const std::string right = in.from == ValueType::string ? pop_text() : text_of(in.from);
    --top_;
    frame_.texts.back() += right;
    if (frame_.texts.back().size() > kLongestText)
      throw EvaluationError("string longer than 1048576 bytes (limit `string-bytes`)");
  }
  static constexpr std::size_t kLongestText = 1 << 20;

  // -------------------------------------------------------------------------------------------------------
  // arithmetic
  void divide_real() {
    --top_;
    if (value_of(top_[1].r) == 0) throw EvaluationError("division by zero");
    const double quotient = value_of(top_->r) / value_of(top_[1].r);
    if constexpr (std::is_same_v<T, double>) {
      top_->r = quotient;
    } else {
      top_->r /= top_[1].r;
      top_->r.v = quotient;  // the same bits as without derivatives
    }
  }

  /// Integers of 32 bits wrap; hardly a deck means that.
  void warn_of_wrapping(const Instruction& in, std::int32_t result) {
    if (frame_.reading)
      frame_.reading->warn_in_expression(
          in.where, in.length, "integer overflow: the result wraps to " + std::to_string(result));
  }

  std::int32_t wrapped(const Instruction& in, std::int64_t exact) {
    const std::int32_t result = wrap(exact);
    if (result != exact) warn_of_wrapping(in, result);
    return result;
  }

  void integer_operation(const Instruction& in) {
    --top_;
    const std::int64_t a = top_->i, b = top_[1].i;
    switch (in.op) {
      case Op::add_integer:
        top_->i = wrapped(in, a + b);
        break;
      case Op::subtract_integer:
        top_->i = wrapped(in, a - b);
        break;
      case Op::multiply_integer:
        top_->i = wrapped(in, a * b);
        break;
      case Op::divide_integer:
        if (b == 0) throw EvaluationError("division by zero");
        if (a / b > std::numeric_limits<std::int32_t>::max())
          throw EvaluationError("integer overflow in division");
        top_->i = wrap(a / b);
        break;
      case Op::modulo:
        if (b == 0) throw EvaluationError("division by zero");
        top_->i = wrap(a % b);
        break;
      case Op::power_integer:
        top_->i = integer_power(top_->i, top_[1].i);
        if (b > 0 && std::pow(static_cast<double>(a), static_cast<double>(b)) != top_->i)
          warn_of_wrapping(in, top_->i);
        break;
      default:
        break;
    }
    if (in.type == ValueType::boolean) top_->i = top_->i != 0;
  }

  void compare(Op op) {
    --top_;
    const double a = value_of(top_->r), b = value_of(top_[1].r);
    switch (op) {
      case Op::less:
        top_->i = a < b;
        break;
      case Op::less_equal:
        top_->i = a <= b;
        break;
      case Op::equal:
        top_->i = a == b;
        break;
      case Op::greater_equal:
        top_->i = a >= b;
        break;
      case Op::greater:
        top_->i = a > b;
        break;
      default:
        top_->i = a != b;
        break;
    }
  }

  void logic(Op op) {
    --top_;
    const bool a = value_of(top_->r) != 0, b = value_of(top_[1].r) != 0;
    top_->i = op == Op::logical_and ? a && b : op == Op::logical_or ? a || b : a != b;
  }

  // --------------------------------------------------------------------------------------------------------
  // functions
  void call(const Instruction& in) {
    top_ -= in.count - 1;
    switch (in.function) {
      case FunctionId::rand:
        top_->i = random();
        break;
      case FunctionId::random:
        top_->r = T(-1 + 2.0 * random() / std::numeric_limits<std::int32_t>::max());
        break;
      case FunctionId::seed:
        seed(static_cast<std::uint32_t>(top_->i));
        break;
      case FunctionId::print:
        print(in);
        break;
      case FunctionId::stop:
        stop();
        break;
      default:
        apply<T>(in.function, top_);
        break;
    }
  }

  std::int32_t random() {
    if (frame_.reading) return frame_.reading->random();
    const std::uint64_t step = static_cast<std::uint64_t>(state().step);
    return hashed_random(frame_.random_key * kFnvPrime + step * 1048573u + ++random_calls_);
  }

  void seed(std::uint32_t value) {
    if (frame_.reading)
      frame_.reading->seed(value);
    else
      frame_.random_key = value;
    top_->i = 0;
  }

  void print(const Instruction& in) {
    if (frame_.reading)
      frame_.reading->print(frame_.reading->expression_span(in.where, in.length),
                            printed(value_of(top_->r)) + '\n');
    top_->i = 0;
  }

  void stop() {
    const int condition = top_->i, status = top_[1].i;
    top_->i = 0;
    if (condition == 0) return;
    if (frame_.reading && status == 0) frame_.reading->exited = true;
    if (frame_.reading) frame_.reading->stop();
    throw EvaluationError("stopped by the deck: stop(" + std::to_string(condition) + ", " +
                          std::to_string(status) + ")");
  }

  void format(const Instruction& in) {
    Value v;
    switch (in.from) {
      case ValueType::boolean:
        v = top_->i != 0;
        break;
      case ValueType::integer:
        v = top_->i;
        break;
      case ValueType::real:
        v = value_of(top_->r);
        break;
      case ValueType::string:
        v = pop_text();
        break;
    }
    --top_;
    frame_.texts.back() = format_value(frame_.texts.back(), v);
  }

  void scalar_function(const Instruction& in) {
    const Program::Function& function = program_.functions[in.index];
    NestedEvaluation::charge(function.evaluations);
    const ScalarFunction& f = *function.object;
    if (in.count == 2) {
      --top_;
      const int order = top_[1].i;
      if (order != 0 && order != 1)
        throw EvaluationError("order of a derivative must be 0 or 1, got " + std::to_string(order));
      if (order == 1) {
        top_->r = T(f.derivative(value_of(top_->r)));
        return;
      }
    }
    const double x = value_of(top_->r);
    if constexpr (std::is_same_v<T, double>)
      top_->r = f.value(x);
    else
      top_->r = top_->r.chain(f.value(x), f.derivative(x));
  }

  void node_function(const Instruction& in) {
    const NodeFunction f = NodeFunction::from_code(in.index);
    const int nodes = f.nodes();
    top_ -= nodes - 1;
    top_->r = T(evaluate(f, *frame_.context, top_->i, nodes == 2 ? top_[1].i : 0));
  }

  void datum(const Instruction& in) {
    const std::string name = pop_text();
    const bool has_label = in.count == 2;
    if (has_label) --top_;
    if (!frame_.context->model) throw EvaluationError("there is no model here");
    const Model& model = *frame_.context->model;
    const DrivePtr drive = in.op == Op::node_datum
                               ? mbcosim::node_datum(model, in.index, top_->i, name)
                               : mbcosim::element_datum(model, static_cast<Family>(in.index),
                                                        has_label, top_->i, name);
    top_->r = T(drive->value(*frame_.context));
  }

  const Program& program_;
  Frame<T>& frame_;
  Slot<T>* base_;
  Slot<T>* locals_;
  Slot<T>* top_ = nullptr;
  std::uint64_t random_calls_ = 0;
};

template <class T>
void start_locals(const Program& program, const Frame<T>& frame, Slot<T>* locals) {
  for (std::size_t k = 0; k < program.locals.size(); ++k) {
    const Program::Local& l = program.locals[k];
    const State* state = frame.context->state;
    const bool from_state =
        l.variable >= 0 && state && static_cast<std::size_t>(l.variable) < state->variables.size();
    const double v = from_state ? state->variables[l.variable] : l.initial;
    if (l.type == ValueType::real)
      locals[k].r = T(v);
    else
      locals[k].i = static_cast<std::int32_t>(v);
  }
}

}  // namespace

template <class T>
Slot<T> run(const Program& program, Frame<T>& frame) {
  constexpr std::size_t kOfADrive = 16;  // instructions that take as long as a drive
  const NestedEvaluation nested;
  NestedEvaluation::charge(static_cast<int>(program.code.size() / kOfADrive));
  Slot<T> small_stack[kSmallStack], small_locals[kSmallLocals];
  std::vector<Slot<T>> large_stack;
  Slot<T>* stack = small_stack;
  if (program.depth > kSmallStack) {
    large_stack.resize(program.depth);
    stack = large_stack.data();
  }
  Slot<T>* locals = small_locals;
  if (frame.keep_locals || program.locals.size() > kSmallLocals) {
    frame.locals.resize(program.locals.size());
    locals = frame.locals.data();
  }
  start_locals(program, frame, locals);
  return Machine<T>(program, frame, stack, locals).run();
}

template Slot<double> run(const Program&, Frame<double>&);
template Slot<Dual<1>> run(const Program&, Frame<Dual<1>>&);
template Slot<Dual<6>> run(const Program&, Frame<Dual<6>>&);
template Slot<Dual<12>> run(const Program&, Frame<Dual<12>>&);

}  // namespace mbcosim
