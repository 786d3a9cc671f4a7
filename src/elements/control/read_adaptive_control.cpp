#include <algorithm>
#include <cstdio>
#include <set>

#include "elements/control/adaptive_control.h"
#include "elements/control/readers.h"
#include "model/model.h"

namespace mbcosim {

namespace {

constexpr int kMostCoefficients = 1000;  ///< of one output
constexpr int kMostWindow = 100000;
constexpr double kMostKept = 1e6;  ///< numbers of samples
constexpr int kMostHorizon = 10000;
constexpr double kMostResponses = 1e5;
constexpr double kMostControls = 300;

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

void check_kept(Card& card, const char* what, int samples, int signals) {
  if (double(samples) * signals > kMostKept)
    card.fail(std::string("discrete control: the ") + what + " of " + std::to_string(samples) +
                  " samples keeps " + number(double(samples) * signals) + " numbers",
              "at most " + number(kMostKept));
}

/// {const, <d> | dynamic, <n1>, <n2>, <rho>, <fact>, <kref>, <klim>}
Forgetting read_forgetting(Card& card, const ArxModel& model) {
  Forgetting f;
  f.dynamic = card.required("forgetting factor", {"const", "dynamic"}) == 1;
  if (!f.dynamic) {
    f.constant = read_between(card, "forgetting factor", 0, 1, true);
    return f;
  }
  f.long_window = read_control_number(card, "window n1", 1, kMostWindow);
  check_kept(card, "window n1", f.long_window, model.outputs);
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

/// Is what follows a word of the card, and neither a number nor a drive?
bool at_next_part(Card& card) {
  const std::string word = card.peek_word();
  return !card.more() || word == "outputs" || word == "controlweights";
}

std::vector<DrivePtr> read_drives(Card& card, const char* what, int count) {
  std::vector<DrivePtr> drives;
  for (int k = 0; k < count; ++k) {
    if (at_next_part(card))
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

/// The options of both kinds of control data. Was there one?
bool read_option(Card& card, Options& options, AdaptiveControl::Settings& s) {
  if (options.at("forgetting factor"))
    s.forgetting = read_forgetting(card, s.model);
  else if (options.at("excitation"))
    s.excitation = read_drives(card, "excitation", s.model.inputs);
  else if (options.at("file"))
    s.file = read_table_name(card);
  else
    return false;
  return true;
}

void check_size(Card& card, const ArxModel& model) {
  if (model.regressors() > kMostCoefficients)
    card.fail("discrete control: the model has " + std::to_string(model.regressors()) +
                  " coefficients for each output",
              "at most " + std::to_string(kMostCoefficients) + "; lower the orders");
}

std::vector<double> read_weights(Card& card, const char* what, int count) {
  std::vector<double> weights(count, 1);
  if (!card.keyword(what)) return weights;
  for (int k = 0; k < count; ++k) {
    if (at_next_part(card))
      card.fail("discrete control: " + std::to_string(count) + " " + what + " expected, found " +
                std::to_string(k));
    weights[k] = read_between(card, what, 0, 1e300, false);
  }
  return weights;
}

/// gpc, <n2>, <nu>, <n1>, [prediction weights, …,] [control weights, …,] <drive>, or deadbeat,
/// <n2>, <nu>.
void read_law(Card& card, int period, AdaptiveControl::Settings& s) {
  const bool gpc = card.required("control law", {"gpc", "deadbeat"}) == 0;
  const int n2 = read_control_number(card, "prediction advancing horizon", 1, kMostHorizon),
            nu = read_control_number(card, "control advancing horizon", 1, n2);
  const double controls = double(nu) * s.model.inputs;
  if (controls > kMostControls || controls * n2 * s.model.outputs > kMostResponses)
    card.fail("discrete control: the horizons ask for " + number(controls) + " controls and " +
                  number(double(n2) * s.model.outputs) + " outputs ahead",
              "at most " + number(kMostControls) + " controls, and a product of at most " +
                  number(kMostResponses));
  if (!gpc) {
    s.law = PredictiveLaw::deadbeat(n2, nu, period);
    return;
  }
  s.law = {n2, nu, read_control_number(card, "prediction receding horizon", 0, n2 - 1),
           {}, {}, period};
  s.law->W = read_weights(card, "prediction weights", n2 - s.law->n1);
  if (std::all_of(s.law->W.begin(), s.law->W.end(), [](double w) { return w == 0; }))
    card.fail("discrete control: all prediction weights are zero");
  s.law->R = read_weights(card, "control weights", nu);
  if (at_next_part(card))
    card.fail("discrete control: the drive of the weight of the controls is missing",
              "gpc, <n2>, <nu>, <n1>, [weights,] <drive>");
  s.control_weight = card.drive("weight of the controls");
}

}  // namespace

AdaptiveControl::Settings read_identification(Card& card, const ControlSizes& sizes) {
  AdaptiveControl::Settings s;
  s.model = {sizes.outputs, sizes.inputs, sizes.order_a, sizes.order_b, false};
  s.model.noise = card.required("kind of identified model", {"arx", "armax"}) == 1;
  check_size(card, s.model);
  Options options(card);
  while (read_option(card, options, s)) {
  }
  return s;
}

AdaptiveControl::Settings read_adaptive_control(Card& card, const ControlSizes& sizes) {
  AdaptiveControl::Settings s;
  s.model = {sizes.outputs, sizes.inputs, sizes.order_a, sizes.order_b, false};
  s.model.noise = card.one_of({"arx", "armax"}) == 1;
  check_size(card, s.model);
  const int period =
      card.keyword("periodic") ? read_control_number(card, "periodic factor", 0, kMostWindow) : 0;
  check_kept(card, "periodic factor", period, 2 * (sizes.outputs + sizes.inputs));
  read_law(card, period, s);
  Options options(card);
  for (;;) {
    if (options.at("trigger"))
      s.trigger = card.drive("trigger");
    else if (options.at("desired output"))
      s.desired = read_drives(card, "desired output", sizes.outputs);
    else if (!read_option(card, options, s))
      return s;
  }
}

}  // namespace mbcosim
