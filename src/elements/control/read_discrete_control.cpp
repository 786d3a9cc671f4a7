#include <cmath>
#include <cstdlib>
#include <sstream>

#include "elements/control/discrete_control.h"
#include "elements/control/readers.h"
#include "elements/families.h"
#include "elements/read_dof.h"
#include "model/model.h"

namespace mbcosim {

namespace {

constexpr int kMost = 1000;  ///< signals, order

/// The numbers of a file of control matrices; what stands behind # or % is a comment.
class MatrixFile {
 public:
  MatrixFile(Card& card, std::string name, const std::string& text)
      : card_(card), name_(std::move(name)) {
    std::istringstream in(text);
    int number = 1;
    for (std::string line; std::getline(in, line); ++number) {
      std::istringstream words(line.substr(0, line.find_first_of("#%")));
      for (std::string word; words >> word;) numbers_.push_back(parsed(word, number));
    }
  }
  std::size_t size() const { return numbers_.size(); }
  /// The next rows × columns numbers, by rows.
  MatX matrix(int rows, int columns) {
    MatX m(rows, columns);
    for (int i = 0; i < rows; ++i)
      for (int j = 0; j < columns; ++j) m(i, j) = numbers_[next_++];
    return m;
  }
  const std::string& name() const { return name_; }

 private:
  double parsed(const std::string& word, int line) const {
    char* end = nullptr;
    const double value = std::strtod(word.c_str(), &end);
    if (*end != 0 || !std::isfinite(value))
      card_.fail(
          "discrete control: \"" + name_ + "\", line " + std::to_string(line) + ": \"" +
              word.substr(0, 40) + "\" is no number",
          "the file has the matrices A₁ … A_q, B₁ … B_p by rows, blanks between the numbers");
    return value;
  }
  Card& card_;
  std::string name_;
  std::vector<double> numbers_;
  std::size_t next_ = 0;
};

DiscreteControl::Gains read_gains(Card& card, const ControlSizes& s) {
  std::string name;
  const std::string text = card.file_contents("file of control matrices", &name);
  MatrixFile file(card, name, text);
  const std::size_t inputs = s.inputs, needed = inputs * (std::size_t(s.order_a) * s.outputs +
                                                          std::size_t(s.order_b) * s.inputs);
  const std::string sizes = std::to_string(s.order_a) + " matrices A (" + std::to_string(s.inputs) +
                            " by " + std::to_string(s.outputs) + ") and " +
                            std::to_string(s.order_b) + " matrices B (" + std::to_string(s.inputs) +
                            " by " + std::to_string(s.inputs) + ")";
  const std::string found = "discrete control: \"" + name + "\" has " +
                            std::to_string(file.size()) + " numbers; " + sizes + " are " +
                            std::to_string(needed);
  if (file.size() < needed) card.fail(found, "check the counts and orders in the card");
  if (file.size() > needed) card.warn(found + "; the rest is not used");
  DiscreteControl::Gains gains;
  for (int k = 0; k < s.order_a; ++k) gains.A.push_back(file.matrix(s.inputs, s.outputs));
  for (int k = 0; k < s.order_b; ++k) gains.B.push_back(file.matrix(s.inputs, s.inputs));
  return gains;
}

/// {[node dof,] <node dof> | drive, <drive>} [, scale, <drive>]
DiscreteControl::Measure read_measure(Card& card) {
  DiscreteControl::Measure m;
  if (card.keyword("drive")) {
    m.value.drive = card.drive("output");
  } else {
    card.keyword("node dof");
    m.value.dof = card.node_dof(true);
  }
  if (card.keyword("scale")) m.scale = card.drive("scale of the output");
  return m;
}

void expect(Card& card, const char* word, const char* or_else = "") {
  if (!card.keyword(word))
    card.fail_expected(std::string("discrete control: `") + word + "`" + or_else + " expected");
}

/// outputs, <measure>, …, inputs, <node dof>, …
void read_signals(Card& card, const ControlSizes& sizes, SampledControl::Signals& signals) {
  for (int k = 0; k < sizes.outputs; ++k) signals.outputs.push_back(read_measure(card));
  expect(card, "inputs");
  for (int k = 0; k < sizes.inputs; ++k)
    signals.inputs.push_back(read_equation_dof(card, "discrete control"));
}

void read_discrete_control(Card& card, ElementInfo& info) {
  ControlSizes sizes;
  SampledControl::Signals signals;
  sizes.outputs = read_control_number(card, "number of outputs", 1, kMost);
  sizes.inputs = read_control_number(card, "number of inputs", 1, kMost);
  sizes.order_b = sizes.order_a = read_control_number(card, "order of the matrices A", 0, kMost);
  if (card.keyword("fir"))
    sizes.order_b = read_control_number(card, "order of the matrices B", 0, kMost);
  signals.period = read_control_number(card, "number of steps between samples", 1, 1000000000);
  std::unique_ptr<GeneralElement> element;
  const int kind = card.required("control data", {"control", "identification", "adaptive control"});
  if (kind == 0) {
    if (sizes.order_a == 0)
      card.fail("discrete control: the order of the matrices A of `control` must be from 1 to " +
                std::to_string(kMost) + ", got 0");
    DiscreteControl::Gains gains = read_gains(card, sizes);
    expect(card, "outputs");
    read_signals(card, sizes, signals);
    element = std::make_unique<DiscreteControl>(std::move(gains), std::move(signals));
  } else {
    AdaptiveControl::Settings settings =
        kind == 1 ? read_identification(card, sizes) : read_adaptive_control(card, sizes);
    expect(card, "outputs",
           kind == 1 ? " (or forgetting factor, excitation, file, each once)"
                     : " (or forgetting factor, excitation, trigger, desired output, file, each "
                       "once)");
    read_signals(card, sizes, signals);
    element = std::make_unique<AdaptiveControl>(std::move(settings), std::move(signals));
  }
  add_general_element(card.builder(), info, std::move(element));
}

}  // namespace

int read_control_number(Card& card, const char* what, int least, int most) {
  const int n = card.integer(what);
  if (n < least || n > most)
    card.fail(std::string("discrete control: the ") + what + " must be from " +
              std::to_string(least) + " to " + std::to_string(most) + ", got " + std::to_string(n));
  return n;
}

void register_control(Registry& registry) {
  registry.typed("electric", Family::electric, {"discrete control"}, read_discrete_control);
}

}  // namespace mbcosim
