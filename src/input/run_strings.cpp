#include "input/run_strings.h"

#include <algorithm>

#include "input/evaluate.h"
#include "input/pending_string.h"
#include "math/dual.h"
#include "math/hash.h"
#include "model/drive.h"
#include "model/expression.h"
#include "model/model.h"

namespace mbcosim {

namespace {

constexpr int kMostArguments = 12;

class StringDrive : public Drive {
 public:
  explicit StringDrive(std::shared_ptr<const PendingString> string) : string_(std::move(string)) {}
  double value(const EvalContext& context, double t) const override {
    return string_->value(context, t);
  }
  double value(const EvalContext& context) const override { return string_->value(context, 0.0); }
  bool has_slope() const override { return true; }
  double slope(const EvalContext& context, double t) const override {
    return string_->slope(context, t);
  }
  void collect_followed(std::vector<NodeDof>& dofs) const override {
    string_->collect_followed(dofs);
  }
  void write_slopes(const EvalContext& context, double factor, double*& next) const override {
    string_->write_slopes(context, factor, next);
  }

 private:
  std::shared_ptr<const PendingString> string_;
};

class StringExpression : public Expression {
 public:
  explicit StringExpression(std::shared_ptr<const PendingString> string)
      : string_(std::move(string)) {}
  int arguments() const override { return string_->arguments(); }
  double value(const EvalContext& context, const double* arguments) const override {
    return string_->value(context, arguments);
  }
  double value_and_gradient(const EvalContext& context, const double* arguments,
                            double* gradient) const override {
    return string_->value_and_gradient(context, arguments, gradient);
  }

 private:
  std::shared_ptr<const PendingString> string_;
};

/// Once a step: strings that assign variables of the deck run in the order of the deck, from the
/// values of the last step; what they assign holds for this step. So results do not depend on the
/// number of iterations.
class AssignmentListener : public StepListener {
 public:
  explicit AssignmentListener(std::vector<std::shared_ptr<const PendingString>> strings)
      : strings_(std::move(strings)) {}
  void advance(const EvalContext& context, State& state, bool) const override {
    for (std::size_t k = 0; k + 1 < state.variables.size(); k += 2)
      state.variables[k] = state.variables[k + 1];
    for (const auto& s : strings_) s->commit(context, &state.variables);
  }

 private:
  std::vector<std::shared_ptr<const PendingString>> strings_;
};

}  // namespace

PendingString::PendingString(Reading& reading, std::string text, SourceSpan where,
                             std::vector<std::string> arguments)
    : reading_(&reading),
      text_(std::move(text)),
      where_(where),
      trail_(reading.trail()),
      arguments_(std::move(arguments)),
      currents_(reading.currents) {
  place_ = reading.place(where) + ":" + std::to_string(where.column);
  random_key_ = fnv1a(text_) ^ fnv1a(place_);
  try {
    parse_string(text_, reading.limits, &syntax_);
  } catch (const ExpressionError& e) {
    fail(reading, e);
  }
  capture(reading);
  for (const SyntaxItem& item : syntax_.items) assigns_ = assigns_ || item.form == Form::assign;
}

/// Variables of loop passes are replaced by their present values.
void PendingString::capture(const Reading& reading) {
  for (const SyntaxItem& item : syntax_.items) {
    if (item.form != Form::name && item.form != Form::assign) continue;
    const Symbol* s = reading.symbols.find(item.name);
    if (s && s->scope > 0) captured_[std::string(item.name)] = {s->value, s->plugin};
  }
}

void PendingString::fail(Reading& reading, const ExpressionError& e) const {
  // Without escapes the text stands in the file as it is, and the place is exact.
  SourceSpan where = where_;
  if (where.file >= 0) {
    const std::size_t begin = reading.offset_of(where_);
    if (reading.file(where.file).text.compare(begin + 1, text_.size(), text_) == 0)
      where = reading.span(where.file, begin + 1 + e.where, e.length);
  }
  Diagnostic d = reading.diagnostic(Severity::error, e.code, where, e.what(), e.hint);
  d.trail.insert(d.trail.begin(),
                 "at offset " + std::to_string(e.where) + " of the string at " + place_);
  throw DeckError(std::move(d));
}

void PendingString::fail_run(const ExpressionError& e) const {
  throw EvaluationError(std::string(e.what()) + " (at offset " + std::to_string(e.where) +
                        " of the string at " + place_ + ")");
}

void PendingString::bind_to(Reading& reading, Program* program) const {
  BindingRules rules;
  rules.run_time = true;
  rules.captured = &captured_;
  rules.arguments = &arguments_;
  rules.text = text_;
  std::map<std::string, double, std::less<>> currents = currents_;
  reading.currents.swap(currents);
  struct Restore {
    Reading& reading;
    std::map<std::string, double, std::less<>>& currents;
    ~Restore() { reading.currents.swap(currents); }
  } restore{reading, currents};
  mbcosim::bind(reading, syntax_, rules, program);
  if (program->type == ValueType::string)
    throw ExpressionError(0, text_.size(),
                          "the value of a run-time string must be a number, string found");
}

bool PendingString::bind(Reading& reading) {
  const int trail = reading.trail();
  reading.set_trail(trail_);
  bool good = true;
  try {
    bind_to(reading, &program_);
  } catch (const ExpressionError& e) {
    good = false;
    try {
      fail(reading, e);
    } catch (const DeckError& d) {
      reading.report(d.diagnostic);
    }
  }
  reading_ = nullptr;
  reading.set_damaged(false);
  reading.set_trail(trail);
  return good;
}

void PendingString::claim_variables(Reading& reading, int* count) {
  for (const SyntaxItem& item : syntax_.items) {
    if (item.form != Form::assign || captured_.count(std::string(item.name))) continue;
    const bool is_local =
        std::any_of(syntax_.declared.begin(), syntax_.declared.end(),
                    [&](const SyntaxItem& d) { return d.name == item.name && !d.if_undefined; });
    Symbol* s = is_local ? nullptr : reading.symbols.find(item.name);
    if (!s || s->constant || s->plugin || s->variable >= 0 || s->role != SymbolRole::plain)
      continue;
    if (type_of(s->value) == ValueType::string) continue;
    s->variable = (*count)++;
  }
}

template <class T>
T PendingString::result(const Program& program, const Slot<T>& slot) const {
  return program.type == ValueType::real ? slot.r : T(static_cast<double>(slot.i));
}

template <class T>
T PendingString::evaluate(const EvalContext& context, const T* arguments, const T& var,
                          const T* drives) const {
  Frame<T> frame;
  frame.context = &context;
  frame.arguments = arguments;
  frame.var = var;
  frame.drives = drives;
  frame.random_key = random_key_;
  try {
    if (!program_.code.empty()) return result(program_, run(program_, frame));
    if (!reading_) throw EvaluationError("the string at " + place_ + " was never bound");
    Program now;  // evaluated while the deck is still being read: with the present meaning of names
    bind_to(*reading_, &now);
    return result(now, run(now, frame));
  } catch (const ExpressionError& e) {
    fail_run(e);
  }
}

double PendingString::value(const EvalContext& context, double var) const {
  return evaluate<double>(context, nullptr, var);
}

double PendingString::value(const EvalContext& context, const double* arguments) const {
  return evaluate<double>(context, arguments, 0);
}

template <class T>
double PendingString::gradient(const EvalContext& context, const double* arguments,
                               double* gradient) const {
  T duals[kMostArguments];
  const int n = static_cast<int>(arguments_.size());
  for (int k = 0; k < n; ++k) duals[k] = T::variable(arguments[k], k);
  const T r = evaluate<T>(context, duals, T(0.0));
  for (int k = 0; k < n; ++k) gradient[k] = r.d[k];
  return r.v;
}

double PendingString::value_and_gradient(const EvalContext& context, const double* arguments,
                                         double* result) const {
  if (arguments_.size() <= 1) return gradient<Dual<1>>(context, arguments, result);
  if (arguments_.size() <= 6) return gradient<Dual<6>>(context, arguments, result);
  return gradient<Dual<12>>(context, arguments, result);
}

double PendingString::slope(const EvalContext& context, double var) const {
  using T = Dual<1>;
  return evaluate<T>(context, nullptr, T::variable(var, 0)).d[0];
}

void PendingString::collect_followed(std::vector<NodeDof>& dofs) const {
  if (program_.drives.size() > kMostArguments) return;
  for (const DrivePtr& drive : program_.drives) drive->collect_followed(dofs);
}

template <class T>
void PendingString::write_slopes_as(const EvalContext& context, double factor,
                                    double*& next) const {
  T drives[kMostArguments];
  for (std::size_t k = 0; k < program_.drives.size(); ++k)
    drives[k] = T::variable(program_.drives[k]->value(context), static_cast<int>(k));
  const T r = evaluate<T>(context, nullptr, T(0.0), drives);
  for (std::size_t k = 0; k < program_.drives.size(); ++k)
    program_.drives[k]->write_slopes(context, factor * r.d[k], next);
}

void PendingString::write_slopes(const EvalContext& context, double factor, double*& next) const {
  if (program_.drives.size() > kMostArguments) return;
  if (program_.drives.size() <= 6)
    write_slopes_as<Dual<6>>(context, factor, next);
  else
    write_slopes_as<Dual<12>>(context, factor, next);
}

void PendingString::commit(const EvalContext& context, std::vector<double>* variables) const {
  Frame<double> frame;
  frame.context = &context;
  frame.random_key = random_key_;
  frame.keep_locals = true;
  try {
    run(program_, frame);
  } catch (const ExpressionError& e) {
    fail_run(e);
  }
  for (std::size_t k = 0; k < program_.locals.size(); ++k) {
    const Program::Local& l = program_.locals[k];
    if (l.variable < 0) continue;
    (*variables)[l.variable + 1] =
        l.type == ValueType::real ? frame.locals[k].r : frame.locals[k].i;
  }
}

// ----------------------------------------------------------------------------------------------------------------
// reader

DrivePtr compile_string(Reading& reading, const std::string& text, SourceSpan where) {
  auto string = std::make_shared<PendingString>(reading, text, where);
  reading.add_pending(string);
  return std::make_shared<StringDrive>(string);
}

ExpressionPtr compile_expression(Reading& reading, const std::string& text,
                                 const std::vector<std::string>& names, SourceSpan where) {
  if (names.size() > kMostArguments)
    reading.fail(where, "an expression can have at most " + std::to_string(kMostArguments) +
                            " variables of its own, got " + std::to_string(names.size()));
  auto string = std::make_shared<PendingString>(reading, text, where, names);
  reading.add_pending(string);
  return std::make_shared<StringExpression>(string);
}

void Reading::bind_strings() {
  int count = 0;
  for (const auto& s : pending_) s->claim_variables(*this, &count);
  std::vector<std::shared_ptr<const PendingString>> assigning;
  for (const auto& s : pending_) {
    if (!s->bind(*this)) continue;
    const auto& locals = s->program().locals;
    if (std::any_of(locals.begin(), locals.end(),
                    [](const Program::Local& l) { return l.variable >= 0; }))
      assigning.push_back(s);
  }
  pending_.clear();
  if (assigning.empty() || !builder_) return;
  std::vector<double>& initial = builder_->model().initial_variables;
  initial.assign(2 * count, 0);
  for (const Symbol* s : symbols.sorted()) {
    if (s->variable < 0) continue;
    double v = 0;
    if (const auto* b = std::get_if<bool>(&s->value))
      v = *b;
    else if (const auto* i = std::get_if<std::int32_t>(&s->value))
      v = *i;
    else if (const auto* d = std::get_if<double>(&s->value))
      v = *d;
    initial[2 * s->variable] = initial[2 * s->variable + 1] = v;
  }
  for (const auto& s : assigning)
    warn(s->where(), "a run-time string assigns a variable of the deck",
         "it runs once at the start of each step; what it assigns holds for that step");
  builder_->on_step(std::make_shared<AssignmentListener>(std::move(assigning)));
}

}  // namespace mbcosim
