/// Appends code to a program and keeps track of the values that it leaves on the stack.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "input/program.h"
#include "input/syntax.h"

namespace mbcosim {

inline bool is_real(ValueType t) { return t == ValueType::real; }
inline bool is_text(ValueType t) { return t == ValueType::string; }

/// The base of binders. `item_` is the piece of the expression that is being bound: instructions
/// and errors get its place.
class Emitter {
 protected:
  Emitter(Reading& reading, bool run_time, Program& program)
      : reading_(reading), run_time_(run_time), out_(program) {}

  /// A value on the stack: its type, and where the code that makes it begins.
  struct Entry {
    ValueType type;
    std::uint32_t start;
    bool constant;
  };

  [[noreturn]] void fail(const std::string& message, const std::string& hint = "",
                         const std::string& code = "expression") const {
    throw ExpressionError(item_->where, item_->length, message, hint, code);
  }
  Instruction& emit(Op op, ValueType type);
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
  void push_value(const Value& v);
  void load_drive(const DrivePtr& drive) {
    load(Op::load_drive, ValueType::real).index = static_cast<std::int32_t>(out_.drives.size());
    out_.drives.push_back(drive);
  }
  /// Where the code of the value `depth` below the top ends.
  std::uint32_t code_end(int depth) const {
    return depth == 0 ? here() : stack_[stack_.size() - depth].start;
  }
  ValueType top_type(int depth = 0) const { return stack_[stack_.size() - 1 - depth].type; }
  void convert(int depth, ValueType to, Loss loss = Loss::silent);
  /// Replaces the `count` topmost values by the one that `op` makes of them.
  Instruction& reduce(int count, Op op, ValueType type);
  /// Run-time strings: computes now what does not depend on anything.
  void fold();

  Reading& reading_;
  const bool run_time_;  ///< a run-time string: what is known now is computed now
  Program& out_;
  const SyntaxItem* item_ = nullptr;
  std::vector<Entry> stack_;
};

}  // namespace mbcosim
