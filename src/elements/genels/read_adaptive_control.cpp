#include <set>

#include "elements/genels/adaptive_control.h"
#include "elements/genels/discrete_control_cards.h"
#include "model/model.h"

namespace mbcosim {

namespace {

constexpr int kMostCoefficients = 1000;  ///< of one output
constexpr int kMostWindow = 100000;

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%g", value);
  return text;
}

double read_between(Card& card, const char* what, double least, double most, bool open) {
  const double value = card.real(what);
  if (!(open ? value > least : value >= least) || !(value <= most))
    card.fail(std::string("discrete control: the ") + what + " must be in " + (open ? "(" : "[") +
              number(least) + ", " + number(most) + "], got " + number(value));
  return value;
}

/// {const, <d> | dynamic, <n1>, <n2>, <rho>, <fact>, <kref>, <klim>}
Forgetting read_forgetting(Card& card) {
  Forgetting f;
  f.dynamic = card.required("forgetting factor", {"const", "dynamic"}) == 1;
  if (!f.dynamic) {
    f.constant = read_between(card, "forgetting factor", 0, 1, true);
    return f;
  }
  f.long_window = read_control_number(card, "window n1", 1, kMostWindow);
  f.short_window = read_control_number(card, "window n2", 1, kMostWindow);
  if (f.short_window > f.long_window)
    card.fail("discrete control: the window n2 = " + std::to_string(f.short_window) +
                  " is longer than n1 = " + std::to_string(f.long_window),
              "n2 samples out of the last n1 are compared with all n1");
  f.rho = read_between(card, "rho", 0, 1, false);
  f.fact = read_between(card, "fact", 0, 1e300, false);
  f.reference = read_between(card, "kref", 0, 1, true);
  f.limit = read_between(card, "klim", 0, 1, true);
  return f;
}

std::vector<DrivePtr> read_drives(Card& card, const char* what, int count) {
  std::vector<DrivePtr> drives;
  for (int k = 0; k < count; ++k) {
    if (!card.more() || card.peek_word() == "outputs")
      card.fail("discrete control: " + std::to_string(count) + " drives of the " + what +
                " expected, found " + std::to_string(k));
    drives.push_back(card.drive(what));
  }
  return drives;
}

/// The name without folders; a deck names no place outside of the run's results.
std::string read_table_name(Card& card) {
  const std::string written = card.quoted("file of the identified model");
  const std::string name = written.substr(written.find_last_of("/\\") + 1);
  const std::string quoted = "discrete control: the file name \"" + written.substr(0, 80) + "\"";
  if (!is_table_name(name))
    card.fail(quoted + " is no name, or that of other results",
              "the file is PREFIX.<name without folders>");
  for (const auto& set : card.builder().model().sets)
    if (const auto* source = dynamic_cast<const SampledTableSource*>(set.get()))
      for (const SampledTable& other : source->sampled_tables())
        if (other.file == name)
          card.fail(quoted + " is that of another element", "give each its own");
  return name;
}

/// What may follow the kind of model, in any order, each at most once.
class Options {
 public:
  explicit Options(Card& card) : card_(card) {}
  /// Is `word` next? Refused when it was there before.
  bool at(const char* word) {
    if (!card_.keyword(word)) return false;
    if (!seen_.insert(word).second)
      card_.fail(std::string("discrete control: `") + word + "` is given twice");
    return true;
  }

 private:
  Card& card_;
  std::set<std::string> seen_;
};

}  // namespace

AdaptiveControl::Settings read_identification(Card& card, const ControlSizes& sizes) {
  AdaptiveControl::Settings s;
  s.model = {sizes.outputs, sizes.inputs, sizes.order_a, sizes.order_b, false};
  s.model.noise = card.required("kind of identified model", {"arx", "armax"}) == 1;
  if (s.model.regressors() > kMostCoefficients)
    card.fail("discrete control: the model has " + std::to_string(s.model.regressors()) +
                  " coefficients for each output",
              "at most " + std::to_string(kMostCoefficients) + "; lower the orders");
  Options options(card);
  for (;;) {
    if (options.at("forgetting factor"))
      s.forgetting = read_forgetting(card);
    else if (options.at("excitation"))
      s.excitation = read_drives(card, "excitation", sizes.inputs);
    else if (options.at("file"))
      s.file = read_table_name(card);
    else
      return s;
  }
}

}  // namespace mbcosim
