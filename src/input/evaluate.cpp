#include "input/evaluate.h"

#include "input/binder.h"
#include "input/cursor.h"

namespace mbcosim {

namespace {

Value value_of_slot(const Program& program, const Slot<double>& slot, Frame<double>& frame) {
  switch (program.type) {
    case ValueType::boolean:
      return slot.i != 0;
    case ValueType::integer:
      return slot.i;
    case ValueType::real:
      return slot.r;
    case ValueType::string:
      return std::move(frame.texts.back());
  }
  return 0.0;
}

Value evaluate_syntax(Reading& reading, const Syntax& syntax, std::string_view text,
                      Program* program, Frame<double>* frame) {
  BindingRules rules;
  rules.text = text;
  bind(reading, syntax, rules, program);
  frame->context = &reading.context();
  frame->reading = &reading;
  frame->texts.clear();
  const Slot<double> slot = run(*program, *frame);
  return value_of_slot(*program, slot, *frame);
}

/// Variables whose declaration failed exist all the same, so that their uses are not reported too.
void declare_damaged(Reading& reading, const Syntax& syntax) {
  for (const SyntaxItem& item : syntax.declared) {
    if (Symbol* known = reading.symbols.find(item.name)) {
      const SourceSpan here = reading.expression_span(item.where, item.length);
      if (known->where.line == here.line && known->where.column == here.column)
        known->damaged = true;
      continue;
    }
    Symbol s;
    s.name = item.name;
    s.damaged = true;
    s.where = reading.expression_span(item.where, item.length);
    switch (item.type) {
      case ValueType::boolean:
        s.value = false;
        break;
      case ValueType::integer:
        s.value = std::int32_t{0};
        break;
      case ValueType::real:
        s.value = 0.0;
        break;
      case ValueType::string:
        s.value = std::string();
        break;
    }
    reading.symbols.declare(std::move(s));
  }
}

[[noreturn]] void fail_in_statement(Reading& reading, const Statement& statement,
                                    const ExpressionError& e) {
  const SourceSpan where = reading.span(statement.file, statement.offset + e.where, e.length);
  if (e.code != "missing-semicolon") reading.fail(where, e.what(), e.hint, e.code);
  const int line = reading.span(statement.file, statement.offset, 1).line;
  reading.fail(where, "\";\" expected at the end of the card begun at line " + std::to_string(line),
               "end that card with \";\"", e.code);
}

}  // namespace

Value evaluate_argument(Reading& reading, const Statement& statement, std::size_t begin,
                        std::size_t* end) {
  ExpressionScratch& scratch = reading.scratch();
  reading.set_expression_place(statement.file, statement.offset);
  try {
    *end = parse_argument(statement.text, begin, reading.limits, &scratch.syntax);
    return evaluate_syntax(reading, scratch.syntax, statement.text, &scratch.program,
                           &scratch.frame);
  } catch (const ExpressionError& e) {
    declare_damaged(reading, scratch.syntax);
    fail_in_statement(reading, statement, e);
  }
}

Value evaluate_part(Reading& reading, std::string_view text, std::size_t where) {
  ExpressionScratch scratch;
  try {
    const std::size_t end = parse_argument(text, 0, reading.limits, &scratch.syntax);
    if (end < text.size()) throw ExpressionError(end, 1, "unexpected \",\"");
    return evaluate_syntax(reading, scratch.syntax, text, &scratch.program, &scratch.frame);
  } catch (const ExpressionError& e) {
    throw ExpressionError(where + e.where, e.length, e.what(), e.hint, e.code);
  }
}

}  // namespace mbcosim
