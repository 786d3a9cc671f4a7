#include "input/emitter.h"

#include "input/reading.h"

namespace mbcosim {

Instruction& Emitter::emit(Op op, ValueType type) {
  Instruction& in = out_.code.emplace_back();
  in.op = op;
  in.type = type;
  in.where = item_->where;
  in.length = item_->length;
  return in;
}

void Emitter::push_value(const Value& v) {
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

void Emitter::convert(int depth, ValueType to, Loss loss) {
  Entry& e = stack_[stack_.size() - 1 - depth];
  if (e.type == to) return;
  if (is_text(e.type)) fail(std::string("cannot convert string to ") + type_name(to), kNoQuotes);
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

Instruction& Emitter::reduce(int count, Op op, ValueType type) {
  const std::uint32_t start = count ? stack_[stack_.size() - count].start : here();
  bool constant = true;
  for (int k = 0; k < count; ++k) constant = constant && stack_[stack_.size() - 1 - k].constant;
  stack_.resize(stack_.size() - count);
  pushed(type, start, constant);
  return emit(op, type);
}

void Emitter::fold() {
  const Entry e = stack_.back();
  if (!run_time_ || !e.constant) return;
  Program part;
  part.code.assign(out_.code.begin() + e.start, out_.code.end());
  part.texts = out_.texts;
  part.depth = static_cast<int>(part.code.size()) + 1;
  Frame<double> frame;
  frame.context = &reading_.context();
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

}  // namespace mbcosim
