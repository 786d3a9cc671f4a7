#include "input/call_binder.h"

#include "input/model_functions.h"
#include "input/nearest.h"
#include "input/reading.h"
#include "input/suggest.h"
#include "model/drive.h"
#include "model/family.h"
#include "model/model.h"
#include "model/registry.h"

namespace mbcosim {

void CallBinder::check_space(const SyntaxItem& item, bool is_function) const {
  if (item.name_space.empty() || item.name_space == "default") return;
  if (item.name_space != "model")
    fail("unknown namespace " + in_quotes(item.name_space), "the namespaces are default and model");
  if (!is_function) fail("namespace model has no variables", "model:: functions need parentheses");
}

void CallBinder::call(const SyntaxItem& item) {
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

void CallBinder::fail_unknown_function(const SyntaxItem& item, const std::string& best) const {
  std::string message = "unknown function " + in_quotes(item.name);
  if (!best.empty()) message += nearest_text(item.name, best);
  fail(message, "", "unknown-function");
}

void CallBinder::check_count(const SyntaxItem& item, std::string_view name, int least,
                             int most) const {
  if (item.count >= least && item.count <= most) return;
  std::string expected = std::to_string(least);
  if (most > least) expected += " or " + std::to_string(most);
  fail("function " + std::string(name) + " expects " + expected +
       (most == 1 ? " argument, " : " arguments, ") + std::to_string(item.count) + " given");
}

void CallBinder::convert_argument(std::string_view name, int k, int count, char kind) {
  const int depth = count - 1 - k;
  const ValueType t = top_type(depth);
  if ((kind == 'S') != is_text(t)) {
    const char* wanted = kind == 'S' ? " must be a string" : " must be a number, string found";
    fail(std::string(name) + ": argument " + std::to_string(k + 1) + wanted);
  }
  if (kind == 'R') convert(depth, ValueType::real);
  if (kind == 'I') convert(depth, ValueType::integer);
}

void CallBinder::call_format() {
  if (!is_text(top_type(1))) fail("sprintf: argument 1 must be a string");
  const ValueType from = top_type();
  reduce(2, Op::format, ValueType::string).from = from;
  fold();
}

void CallBinder::call_conversion(ValueType to) {
  convert(0, to);
  fold();
}

void CallBinder::model_call(const SyntaxItem& item) {
  if (!reading_.model_available())
    fail("model::" + std::string(item.name) +
         " is not available before the end of the \"initial value\" block");
  const std::size_t colons = item.name.find("::");
  if (colons != std::string_view::npos) {
    const std::string_view space = item.name.substr(0, colons), name = item.name.substr(colons + 2);
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

Instruction& CallBinder::reduce_model(int count, Op op) {
  Instruction& in = reduce(count, op, ValueType::real);
  in.count = static_cast<std::uint8_t>(count);
  stack_.back().constant = false;
  return in;
}

void CallBinder::call_drive(const SyntaxItem& item) {
  check_count(item, item.name, 2, 2);
  convert_argument(item.name, 0, 2, 'I');
  convert_argument(item.name, 1, 2, 'R');
  reduce_model(2, item.name == "drive" ? Op::drive_value : Op::drive_derivative);
}

void CallBinder::call_current(const SyntaxItem& item) {
  check_count(item, "current", 1, 1);
  if (!is_text(top_type()) || out_.code.back().op != Op::push_text)
    fail("current: the argument must be a string");
  const std::string name = out_.texts[out_.code.back().index];
  const auto value = reading_.currents.find(name);
  if (value == reading_.currents.end())
    fail("no value \"" + name + "\" is supplied by the card being read");
  out_.code.pop_back();
  stack_.pop_back();
  push_real(value->second);
}

void CallBinder::call_scalar_function(const SyntaxItem& item, std::string_view name) {
  check_count(item, item.name, 1, 2);
  const auto f = reading_.functions.find(name);
  if (f == reading_.functions.end())
    fail("scalar function " + in_quotes(name) + " is not defined",
         suggested_function(name, reading_.functions));
  convert_argument(item.name, 0, item.count, 'R');
  if (item.count == 2) convert_argument(item.name, 1, 2, 'I');
  reduce_model(item.count, Op::function_value).index =
      static_cast<std::int32_t>(out_.functions.size());
  out_.functions.push_back({f->second.object, f->second.weight.objects});
}

void CallBinder::call_node_datum(const SyntaxItem& item, std::string_view name) {
  const int type = node_type(name);
  if (type < 0)
    fail("unknown node type " + in_quotes(name),
         "structural, abstract, electric, hydraulic, thermal or parameter");
  check_count(item, item.name, 2, 2);
  call_datum(item, Op::node_datum, type);
}

void CallBinder::call_element_datum(const SyntaxItem& item, std::string_view name) {
  const FamilyFacts* const family = family_by_function(normalized(name));
  if (!family) fail("unknown element type " + in_quotes(name));
  check_count(item, item.name, 1, 2);
  call_datum(item, Op::element_datum, static_cast<int>(family->family));
}

void CallBinder::call_datum(const SyntaxItem& item, Op op, int index) {
  if (item.count == 2) convert_argument(item.name, 0, 2, 'I');
  convert_argument(item.name, item.count - 1, item.count, 'S');
  if (run_time_ && bind_datum(item.count, op, index)) return;
  reduce_model(item.count, op).index = index;
}

bool CallBinder::bind_datum(int count, Op op, int index) {
  const Entry& text = stack_.back();
  const Entry& first = stack_[stack_.size() - count];
  if (!text.constant || !first.constant || !reading_.builder()) return false;
  const std::string name = out_.texts[out_.code[text.start].index];
  const int label = count == 2 ? out_.code[first.start].integer : 0;
  const Model& model = reading_.builder()->model();
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

std::string CallBinder::nearest_text(std::string_view name, const std::string& best) {
  const bool case_only = Nearest(name).is_case_of(best);
  return (case_only ? "; names are case sensitive; did you mean " : "; did you mean ") +
         in_quotes(best) + "?";
}

}  // namespace mbcosim
