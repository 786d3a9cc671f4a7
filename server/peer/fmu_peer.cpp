#include "peer/fmu_peer.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <sstream>
#include <stdexcept>

#include "peer/options.h"

namespace mbcosim::peer {
namespace {

std::string listed(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return text.empty() ? "none" : text;
}

int place(const std::vector<std::string>& names, const std::string& name) {
  const auto found = std::find(names.begin(), names.end(), name);
  return found == names.end() ? -1 : static_cast<int>(found - names.begin());
}

using Variables = std::map<std::string, FmuArchive::Variable>;

std::string numbered(const std::string& name, std::size_t k) {
  return name + "[" + std::to_string(k + 1) + "]";
}

/// Names of the numbers of a variable.
std::vector<std::string> numbers_of(const std::string& name, std::size_t size) {
  if (size == 1) return {name};
  std::vector<std::string> names;
  for (std::size_t k = 0; k < size; ++k) names.push_back(numbered(name, k));
  return names;
}

/// The variable that has the number "name" or "name[k]"; end: none.
Variables::const_iterator owner_of(const Variables& variables, const std::string& name) {
  const auto known = variables.find(name);
  if (known != variables.end() || !name.ends_with(']')) return known;
  const auto array = variables.find(name.substr(0, name.rfind('[')));
  if (array == variables.end() || array->second.size == 1) return variables.end();
  const auto names = numbers_of(array->first, array->second.size);
  return place(names, name) < 0 ? variables.end() : array;
}

/// `map` by numbers of the FMU, each checked against the signals of the port.
std::map<std::string, std::string> by_numbers(const Variables& variables,
                                              const PortSignals& signals,
                                              const std::map<std::string, std::string>& map) {
  std::map<std::string, std::string> result;
  for (const auto& [name, signal] : map) {
    const auto owner = owner_of(variables, name);
    if (owner == variables.end() || !owner->second.real ||
        (!owner->second.input && !owner->second.output))
      throw std::runtime_error("--map: the FMU has no real input or output \"" + name + "\"");
    const FmuArchive::Variable& variable = owner->second;
    if (variable.size == 0)
      throw std::runtime_error("--map: the size of \"" + name +
                               "\" follows from a structural parameter; arrays of fixed sizes "
                               "are served");
    const std::size_t size = owner->first == name ? variable.size : 1;
    const auto theirs = numbers_of(signal, size);
    for (const std::string& each : theirs)
      if (place(variable.input ? signals.outputs : signals.inputs, each) < 0)
        throw std::runtime_error("--map: the port has no signal \"" + each + "\"; it sends " +
                                 listed(signals.outputs) + " and takes " + listed(signals.inputs));
    const auto ours = numbers_of(name, size);
    for (std::size_t k = 0; k < size; ++k) result[ours[k]] = theirs[k];
  }
  return result;
}

std::string start_of_unset(const std::string& name, const FmuArchive::Variable& input) {
  if (!input.start)
    throw std::runtime_error(
        "the FMU's input \"" + name +
        "\" has neither a signal nor a start value, which FMI wants of inputs; "
        "name a signal: --map " +
        name + "=SIGNAL");
  return *input.start;
}

/// Start values of an array, one for each number.
std::vector<double> starts_of(const std::string& name, const FmuArchive::Variable& input) {
  std::istringstream text(start_of_unset(name, input));
  const std::vector<double> starts{std::istream_iterator<double>(text), {}};
  if (!text.eof() || starts.size() != input.size)
    throw std::runtime_error("the FMU's input \"" + name + "\" has " + std::to_string(input.size) +
                             " numbers, but its start values are \"" + *input.start + "\"");
  return starts;
}

/// The signal of each number of a variable among `signals`; -1: none.
std::vector<int> places_of(const std::string& name, const FmuArchive::Variable& variable,
                           const std::vector<std::string>& signals,
                           const std::map<std::string, std::string>& map) {
  std::vector<int> places;
  if (!variable.real) return places;
  for (const std::string& number : numbers_of(name, variable.size)) {
    const auto mapped = map.find(number);
    places.push_back(place(signals, mapped == map.end() ? number : mapped->second));
  }
  return places;
}

bool is_tied(const std::vector<int>& places) {
  return std::any_of(places.begin(), places.end(), [](int k) { return k >= 0; });
}

void add_input(const std::string& name, const FmuArchive::Variable& input,
               const std::vector<int>& places, SignalMap& result) {
  if (!is_tied(places)) {
    result.unset[name] = start_of_unset(name, input);
    return;
  }
  const bool whole = std::find(places.begin(), places.end(), -1) == places.end();
  const std::vector<double> starts =
      whole ? std::vector<double>(places.size()) : starts_of(name, input);
  result.inputs.push_back(input.reference);
  for (std::size_t k = 0; k < places.size(); ++k) {
    result.sources.push_back({places[k], starts[k]});
    if (places[k] < 0) result.unset[numbered(name, k)] = (std::ostringstream() << starts[k]).str();
  }
}

}  // namespace

SignalMap map_signals(const FmuArchive& archive, const PortSignals& signals,
                      const std::map<std::string, std::string>& map) {
  const auto chosen = by_numbers(archive.variables(), signals, map);
  SignalMap result;
  result.targets.assign(signals.inputs.size(), -1);
  for (const auto& [name, variable] : archive.variables()) {
    if (variable.input)
      add_input(name, variable, places_of(name, variable, signals.outputs, chosen), result);
    if (!variable.output) continue;
    const auto places = places_of(name, variable, signals.inputs, chosen);
    if (!is_tied(places)) continue;
    for (std::size_t k = 0; k < places.size(); ++k)
      if (places[k] >= 0) result.targets[places[k]] = static_cast<int>(result.output_size + k);
    result.outputs.push_back(variable.reference);
    result.output_size += places.size();
  }
  for (std::size_t k = 0; k < result.targets.size(); ++k)
    if (result.targets[k] < 0)
      throw std::runtime_error("the FMU gives nothing for the signal \"" + signals.inputs[k] +
                               "\"; name one of its outputs: --map OUTPUT=" + signals.inputs[k]);
  return result;
}

FmuPeer::FmuPeer(Controller& controller, SignalMap map, bool keeps_states, double time)
    : controller_(controller),
      map_(std::move(map)),
      keeps_states_(keeps_states),
      time_(time),
      before_(time) {
  controller_.start(time);
}

void FmuPeer::begin_step() {
  if (keeps_states_) controller_.keep();
  kept_ = keeps_states_;
  before_ = time_;
}

void FmuPeer::go_back() {
  controller_.restore();
  time_ = before_;
}

bool FmuPeer::is_before_kept(const client::Motion& motion, double target) const {
  if (motion.step < step_) return true;
  const double tolerance = tolerance_at(target);
  if (target > time_ + tolerance) return false;
  return kept_ ? target <= before_ + tolerance : step_ >= 0 || target < time_ - tolerance;
}

void FmuPeer::enter_step(const client::Motion& motion, double target) {
  if (is_before_kept(motion, target)) {
    std::ostringstream text;
    text << "the simulation went back to t = " << std::min(motion.time, target)
         << ", the FMU stands at t = " << time_ << " and keeps no state of it; attach it anew";
    throw Lost(text.str());
  }
  const bool again = in_step_ || target <= time_ + tolerance_at(target);
  if (again && kept_)
    go_back();
  else
    begin_step();
  step_ = motion.step;
  in_step_ = motion.iteration > 0;
}

std::vector<double> FmuPeer::advance(const client::Motion& motion, double target) {
  std::vector<double> inputs;
  for (const auto& [signal, start] : map_.sources)
    inputs.push_back(signal < 0 ? start : motion.signals.at(signal));
  if (!inputs.empty()) controller_.set(map_.inputs, inputs);
  if (target > time_ + tolerance_at(target)) {
    controller_.do_step(time_, target - time_);
    time_ = target;
  }
  const std::vector<double> given = controller_.get(map_.outputs, map_.output_size);
  std::vector<double> loads;
  for (const int place : map_.targets) loads.push_back(given[place]);
  return loads;
}

std::vector<double> FmuPeer::exchange(const client::Motion& motion) {
  const double target = motion.iteration > 0 ? motion.time : motion.target_time;
  enter_step(motion, target);
  try {
    return advance(motion, target);
  } catch (const std::exception& failure) {
    const std::string what = failure.what();
    if (!kept_) throw Lost(what + "; it keeps no states and cannot go on");
    try {
      go_back();
    } catch (const std::exception& e) {
      throw Lost(what + ", then " + e.what() + "; it cannot go on");
    }
    throw;
  }
}

void FmuPeer::step_ended(bool accepted, std::int64_t step) {
  if (!accepted && in_step_) go_back();
  if (!accepted) step_ = std::min(step_, step);
  in_step_ = false;
}

}  // namespace mbcosim::peer
