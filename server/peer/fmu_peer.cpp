#include "peer/fmu_peer.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace mbcosim::peer {
namespace {

constexpr double kRounding = 1e-9;

std::string listed(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return text.empty() ? "none" : text;
}

int place(const std::vector<std::string>& names, const std::string& name) {
  const auto found = std::find(names.begin(), names.end(), name);
  return found == names.end() ? -1 : static_cast<int>(found - names.begin());
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

}  // namespace

SignalMap map_signals(const FmuArchive& archive, const PortSignals& signals,
                      const std::map<std::string, std::string>& map) {
  for (const auto& [name, signal] : map) {
    const auto known = archive.variables().find(name);
    if (known == archive.variables().end() || !known->second.real ||
        (!known->second.input && !known->second.output))
      throw std::runtime_error("--map: the FMU has no real input or output \"" + name + "\"");
    if (place(known->second.input ? signals.outputs : signals.inputs, signal) < 0)
      throw std::runtime_error("--map: the port has no signal \"" + signal + "\"; it sends " +
                               listed(signals.outputs) + " and takes " + listed(signals.inputs));
  }
  SignalMap result;
  result.outputs.resize(signals.inputs.size());
  std::vector<bool> given(signals.inputs.size(), false);
  for (const auto& [name, variable] : archive.variables()) {
    const auto mapped = map.find(name);
    const std::string& signal = mapped == map.end() ? name : mapped->second;
    const int source = variable.real ? place(signals.outputs, signal) : -1;
    if (variable.input && source >= 0) {
      result.inputs.push_back(variable.reference);
      result.sources.push_back(source);
    } else if (variable.input) {
      result.unset[name] = start_of_unset(name, variable);
    }
    const int target = variable.real ? place(signals.inputs, signal) : -1;
    if (variable.output && target >= 0) {
      result.outputs[target] = variable.reference;
      given[target] = true;
    }
  }
  for (std::size_t k = 0; k < given.size(); ++k)
    if (!given[k])
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
  before_ = time_;
  in_step_ = true;
}

void FmuPeer::go_back() {
  if (!keeps_states_)
    throw std::runtime_error("the step is asked for again, and the FMU has no way back");
  controller_.restore();
  time_ = before_;
}

std::vector<double> FmuPeer::exchange(const client::Motion& motion) {
  const bool implicit = motion.iteration > 0;
  const double target = implicit ? motion.time : motion.target_time;
  const double tolerance = kRounding * std::max(1.0, std::abs(target));
  const bool again = implicit ? in_step_ : target <= time_ + tolerance;
  if (again)
    go_back();
  else
    begin_step();
  std::vector<double> inputs;
  for (const int source : map_.sources) inputs.push_back(motion.signals.at(source));
  if (!inputs.empty()) controller_.set(map_.inputs, inputs);
  if (target > time_ + tolerance) {
    controller_.do_step(time_, target - time_);
    time_ = target;
  }
  return controller_.get(map_.outputs);
}

void FmuPeer::step_ended(bool accepted) {
  if (!accepted && in_step_) go_back();
  in_step_ = false;
}

}  // namespace mbcosim::peer
