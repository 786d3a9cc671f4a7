#include "elements/genels/linear_system.h"
#include "elements/genels/readers.h"
#include "elements/read_dof.h"

namespace mbcosim {

namespace {

constexpr int kMostStates = 2000;

int read_size(Card& card, const char* what, int least) {
  const int n = card.integer(what);
  if (n < least || n > kMostStates)
    card.fail(std::string(what) + " must be between " + std::to_string(least) + " and " +
              std::to_string(kMostStates) + ", got " + std::to_string(n));
  return n;
}

/// [node dof,] <node dof> | drive, <drive>
ScalarValue read_input(Card& card) {
  ScalarValue value;
  if (card.keyword("drive")) {
    value.drive = card.drive("input");
    return value;
  }
  if (!card.keyword("node dof"))
    card.warn_at(card.next(),
                 "`node dof` or `drive` is missing before the input; `node dof` assumed");
  value.dof = card.node_dof(true);
  return value;
}

NodeDof read_output(Card& card, const char* what) {
  const SourceSpan where = card.next();
  const NodeDof dof = read_value_dof(card, what);
  if (!dof.differential)
    card.fail_at(where, std::string(what) + ": the output must be a differential node",
                 "declare the abstract node `differential`");
  return dof;
}

/// [matrix E,] matrix A, matrix B, matrix C [, matrix D] [, gain, k]
LinearSystem read_matrices(Card& card, int outputs, int inputs, int n) {
  LinearSystem s;
  const auto expect = [&](const char* word) {
    if (!card.keyword(word)) card.fail_expected(std::string("`") + word + "` expected");
  };
  if (card.keyword("matrix E")) s.E = card.numbers("matrix E", n, n);
  expect("matrix A");
  s.A = card.numbers("matrix A", n, n);
  expect("matrix B");
  s.B = card.numbers("matrix B", n, inputs);
  expect("matrix C");
  s.C = card.numbers("matrix C", outputs, n);
  if (card.keyword("matrix D")) s.D = card.numbers("matrix D", outputs, inputs);
  return s;
}

/// [gain, k,]
double read_gain(Card& card) { return card.keyword("gain") ? card.real("gain") : 1; }

/// [balance, {yes|no},]
void read_balance(Card& card, LinearSystem& s) {
  if (!card.keyword("balance") || card.yes_no("balance")) balance(s);
}

/// [value, x0 [, derivative, xp0]]
void read_start(Card& card, int n, bool has_rates, LinearSystemElement& element) {
  if (!card.keyword("value")) return;
  VecX x = card.numbers("initial states", 1, n).transpose(), xp;
  if (has_rates && card.keyword("derivative")) xp = card.numbers("initial rates", 1, n).transpose();
  element.set_start(std::move(x), std::move(xp));
}

void add_state_space(Card& card, ElementInfo& info, std::vector<NodeDof> outputs,
                     std::vector<ScalarValue> inputs) {
  const int n = read_size(card, "order", 1);
  LinearSystem s =
      read_matrices(card, static_cast<int>(outputs.size()), static_cast<int>(inputs.size()), n);
  const double gain = read_gain(card);
  s.C *= gain;
  s.D *= gain;
  read_balance(card, s);
  const bool descriptor = s.E.size() != 0;
  auto element =
      std::make_unique<LinearSystemElement>(std::move(s), std::move(outputs), std::move(inputs));
  read_start(card, n, descriptor, *element);
  add_general_element(card.builder(), info, std::move(element));
}

void read_siso(Card& card, ElementInfo& info) {
  std::vector<NodeDof> outputs{read_output(card, "state space SISO")};
  std::vector<ScalarValue> inputs{read_input(card)};
  add_state_space(card, info, std::move(outputs), std::move(inputs));
}

void read_mimo(Card& card, ElementInfo& info) {
  std::vector<NodeDof> outputs;
  std::vector<ScalarValue> inputs;
  const int output_count = read_size(card, "number of outputs", 1);
  for (int k = 0; k < output_count; ++k) outputs.push_back(read_output(card, "state space MIMO"));
  const int input_count = read_size(card, "number of inputs", 1);
  for (int k = 0; k < input_count; ++k) inputs.push_back(read_input(card));
  add_state_space(card, info, std::move(outputs), std::move(inputs));
}

std::vector<double> read_reals(Card& card, const char* what, int count) {
  std::vector<double> values;
  for (int k = 0; k < count; ++k) values.push_back(card.real(what));
  return values;
}

void read_scalar_filter(Card& card, ElementInfo& info) {
  std::vector<NodeDof> outputs{read_output(card, "scalar filter")};
  std::vector<ScalarValue> inputs{read_input(card)};
  CanonicalForm form = CanonicalForm::controllable;
  if (card.keyword("canonical form") &&
      card.required("canonical form", {"controllable", "observable"}) == 1)
    form = CanonicalForm::observable;
  const int n = read_size(card, "order of the denominator", 1);
  const std::vector<double> denominator = read_reals(card, "denominator coefficient", n);
  const int m = read_size(card, "order of the numerator", 0);
  if (m > n)
    card.fail("scalar filter: the numerator's order " + std::to_string(m) +
              " exceeds the denominator's " + std::to_string(n));
  std::vector<double> numerator = read_reals(card, "numerator coefficient", m + 1);
  const double gain = read_gain(card);
  for (double& coefficient : numerator) coefficient *= gain;
  LinearSystem s = companion_system(form, denominator, numerator);
  read_balance(card, s);
  auto element =
      std::make_unique<LinearSystemElement>(std::move(s), std::move(outputs), std::move(inputs));
  add_general_element(card.builder(), info, std::move(element));
}

}  // namespace

void register_state_spaces(Registry& registry) {
  registry.typed("genel", Family::genel, {"state space SISO"}, read_siso);
  registry.typed("genel", Family::genel, {"state space MIMO"}, read_mimo);
  registry.typed("genel", Family::genel, {"scalar filter"}, read_scalar_filter);
}

}  // namespace mbcosim
