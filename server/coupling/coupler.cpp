#include "coupling/coupler.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "wire/refusal.h"

namespace mbcosim::server {
namespace {

using Clock = std::chrono::steady_clock;

/// Adds the time of its life to a counter.
class Stopwatch {
 public:
  explicit Stopwatch(double& seconds) : seconds_(seconds) {}
  ~Stopwatch() { seconds_ += std::chrono::duration<double>(Clock::now() - start_).count(); }
  Stopwatch(const Stopwatch&) = delete;
  Stopwatch& operator=(const Stopwatch&) = delete;

 private:
  double& seconds_;
  Clock::time_point start_ = Clock::now();
};

/// Do kept answers mean something else?
bool writes_otherwise(const Agreement& now, const Agreement& before) {
  if (!now.follows() || !before.follows()) return now.follows() != before.follows();
  return now.frame != before.frame || now.global_reference_loads != before.global_reference_loads;
}

}  // namespace

Coupler::Coupler(const google::protobuf::RepeatedPtrField<v1::PortDefinition>& ports,
                 const Simulation& simulation, std::chrono::milliseconds longest_wait,
                 Recorder* recorder, const std::set<std::string>& served, bool optional)
    : longest_wait_(longest_wait), recorder_(recorder), optional_(optional) {
  const auto add_own = [&](PortModel model) {
    if (served.count(model.name()) > 0)
      claim(model, simulation);
    else
      add(std::move(model), simulation);
  };
  for (const PortElementRef& element : port_elements(simulation.model()))
    add_own({element, simulation});
  for (const v1::PortDefinition& definition : ports) {
    const bool in_model =
        definition.kind() == v1::PORT_KIND_MOTION || definition.kind() == v1::PORT_KIND_MODAL;
    const Port* known = in_model ? find(definition.name()) : nullptr;
    if (!known || known->model().layout().kind() != definition.kind())
      add({definition, simulation}, simulation);
  }
  for (const StructuralPort& port : simulation.model().structural_ports)
    add_own({port, simulation});
  for (const StreamInput& stream : simulation.model().stream_inputs) {
    PortModel model(stream, simulation);
    const bool taken = written_.count(model.written().front()) > 0;  // by a port of the client
    if (served.count(model.name()) > 0 || (!taken && !find(model.name())))
      add_own(std::move(model));
  }
}

void Coupler::add(PortModel model, const Simulation& simulation) {
  if (find(model.name()))
    throw Refusal(v1::REASON_BAD_ARGUMENT, "two ports are named \"" + model.name() + "\"");
  claim(model, simulation);
  if (optional_) model.make_optional();
  ports_.push_back(std::make_unique<Port>(std::move(model), longest_wait_, recorder_));
  lines_.emplace_back().port = ports_.back().get();
}

/// What it writes belongs to it alone.
void Coupler::claim(const PortModel& model, const Simulation& simulation) {
  for (const int handle : model.written()) {
    if (!written_.insert(handle).second)
      throw Refusal(v1::REASON_BAD_ARGUMENT, "port \"" + model.name() + "\": variable \"" +
                                                 simulation.variables()[handle].name +
                                                 "\" is written by another port, too");
  }
}

Port* Coupler::find(const std::string& name) const {
  for (const auto& port : ports_)
    if (port->model().name() == name) return port.get();
  return nullptr;
}

std::vector<v1::PortWait> Coupler::waits() const {
  std::vector<v1::PortWait> all;
  for (const auto& port : ports_)
    if (auto wait = port->waiting()) all.push_back(std::move(*wait));
  return all;
}

bool Coupler::has_tight() const {
  return std::any_of(lines_.begin(), lines_.end(),
                     [](const Line& line) { return line.agreement.is_tight(); });
}

bool Coupler::has_window() const {
  return std::any_of(lines_.begin(), lines_.end(),
                     [](const Line& line) { return line.agreement.is_window(); });
}

int Coupler::maximum_passes() const {
  int most = 1;
  for (const Line& line : lines_)
    if (line.agreement.is_window()) most = std::max(most, line.agreement.maximum_passes);
  return most;
}

void Coupler::fill(Line& line, const Simulation& simulation, double target_time, int iteration) {
  line.message.Clear();
  v1::ServerExchange* out = line.message.mutable_exchange();
  out->set_step(simulation.step_number());
  out->set_time(simulation.time());
  out->set_target_time(target_time);
  line.target_time = target_time;
  out->set_iteration(iteration);
  line.port->model().fill(simulation, line.agreement, out);
}

void Coupler::reset() {
  for (Line& line : lines_) {
    line.history.clear();
    line.sent_for = line.answered_for = -1;
    line.port->forget();
  }
}

// ------------------------------------------------------------------ from process to process

google::protobuf::RepeatedPtrField<v1::CheckpointPort> Coupler::memory() const {
  google::protobuf::RepeatedPtrField<v1::CheckpointPort> memory;
  for (const Line& line : lines_) {
    v1::CheckpointPort* out = memory.Add();
    out->set_port(line.port->model().name());
    out->set_had_peer(line.port->had_peer());
    out->set_input_hold(line.agreement.hold);
    if (line.agreement.follows()) {
      out->mutable_form()->set_frame(line.agreement.frame);
      out->mutable_form()->set_following_loads(true);
      out->mutable_form()->set_global_reference_loads(line.agreement.global_reference_loads);
    }
    if (line.answered_for >= 0) out->set_answered_for_step(line.answered_for);
    for (const InputHistory::Point& point : line.history.points()) {
      v1::CheckpointAnswer* answer = out->add_answers();
      answer->set_time(point.time);
      answer->mutable_values()->Add(point.values.begin(), point.values.end());
    }
  }
  return memory;
}

namespace {

/// Throws DAMAGED_STATE: what no port leaves behind.
void check_memory(const PortModel& port, const v1::CheckpointPort& memory) {
  double last = -std::numeric_limits<double>::infinity();
  bool sound = v1::InputHold_IsValid(memory.input_hold()) &&
               v1::PortFrame_IsValid(memory.form().frame()) &&
               (!memory.has_answered_for_step() || memory.answered_for_step() >= 0);
  for (const v1::CheckpointAnswer& answer : memory.answers()) {
    sound = sound && std::isfinite(answer.time()) && answer.time() > last &&
            answer.values_size() == port.answer_size() &&
            std::all_of(answer.values().begin(), answer.values().end(),
                        [](double value) { return std::isfinite(value); });
    last = answer.time();
  }
  if (!sound)
    throw Refusal(v1::REASON_DAMAGED_STATE,
                  "what is stored of port \"" + port.name() + "\" does not fit the port");
}

}  // namespace

void Coupler::take_over(const google::protobuf::RepeatedPtrField<v1::CheckpointPort>& memory) {
  for (const v1::CheckpointPort& in : memory)
    for (Line& line : lines_) {
      if (line.port->model().name() != in.port()) continue;
      check_memory(line.port->model(), in);
      line.agreement.hold = in.input_hold();
      if (in.has_form()) {
        line.agreement.frame = in.form().frame();
        line.agreement.following_loads = in.form().following_loads();
        line.agreement.global_reference_loads = in.form().global_reference_loads();
      }
      if (in.had_peer()) line.port->expect_peer(line.agreement);
      line.agreement = line.port->agreement();
      line.history = InputHistory(line.agreement.held_answers());
      for (const v1::CheckpointAnswer& answer : in.answers())
        line.history.add(answer.time(), {answer.values().begin(), answer.values().end()});
      if (in.has_answered_for_step()) line.answered_for = in.answered_for_step();
    }
}

// ------------------------------------------------------------------ explicit ports

void Coupler::await_peers(const CancelToken& cancel) {
  const Stopwatch watch(waited_);
  for (Line& line : lines_) line.port->await_peer(cancel);
}

// Explicit peers cannot go back: who has answered is not asked again when a step is repeated.
bool Coupler::asks(const Line& line, std::int64_t step) const {
  if (line.agreement.is_implicit() || line.port->is_idle()) return false;
  if (line.history.empty()) return true;
  return line.answered_for != step && step % line.agreement.every == 0;
}

// Kept answers stay as far as they mean the same.
void Coupler::take_agreement(Line& line, const Agreement& now) {
  if (now.hold != line.agreement.hold || writes_otherwise(now, line.agreement))
    line.history = InputHistory(now.held_answers());
  line.agreement = now;
}

void Coupler::prepare(const Simulation& simulation, double length, bool estimated) {
  const std::int64_t step = simulation.step_number();
  target_time_ = simulation.time() + length;
  for (Line& line : lines_) {
    const Agreement now = line.port->agreement();
    const bool same_peer = now.generation == line.agreement.generation;
    take_agreement(line, now);
    line.due = asks(line, step);
    const bool on_its_way = same_peer && line.sent_for == step && line.port->is_waiting();
    if (!line.due || on_its_way) continue;
    line.sent_for = -1;
    fill(line, simulation, target_time_, 0);
    line.message.mutable_exchange()->set_target_estimated(estimated ||
                                                          now.mode == v1::COUPLING_MODE_STAGGERED);
  }
}

void Coupler::take_answer(Line& line, const CancelToken& cancel) {
  const std::int64_t step = line.sent_for;
  line.sent_for = -1;
  const auto answer = line.port->take(cancel);
  if (!answer) return;
  line.history.add(line.target_time, answer->values);
  line.answered_for = step;
}

// All peers compute at the same time: everything is sent before the first answer is awaited.
void Coupler::exchange(const CancelToken& cancel) {
  const Stopwatch watch(waited_), exchange(exchanged_);
  if (std::any_of(lines_.begin(), lines_.end(), [](const Line& line) { return line.due; }))
    ++exchanges_;
  for (Line& line : lines_) {
    if (!line.due || line.sent_for >= 0) continue;
    line.sent_for = line.message.exchange().step();
    line.port->send(line.message, line.agreement.generation, cancel);
  }
  for (Line& line : lines_)
    if (line.due) take_answer(line, cancel);
}

void Coupler::apply(Simulation& simulation) {
  for (Line& line : lines_)
    if (!line.agreement.is_implicit() && !line.history.empty() && !line.agreement.follows())
      line.port->model().apply(line.history.at(target_time_), simulation);
  turn_loads(simulation);
}

bool Coupler::has_following() const {
  return std::any_of(lines_.begin(), lines_.end(),
                     [](const Line& line) { return line.agreement.follows(); });
}

void Coupler::turn_loads(Simulation& simulation) const {
  for (const Line& line : lines_)
    if (line.agreement.follows() && !line.history.empty())
      line.port->model().apply_following(line.history.at(target_time_), line.agreement, simulation);
}

void Coupler::finish(const Simulation& simulation, const CancelToken& cancel) {
  for (Line& line : lines_) {
    const bool staggered = line.agreement.mode == v1::COUPLING_MODE_STAGGERED;
    if (!staggered || simulation.finished() || simulation.step_number() % line.agreement.every != 0)
      continue;
    if (!line.port->has_peer()) continue;
    fill(line, simulation, simulation.time() + simulation.next_step_size(), 0);
    line.message.mutable_exchange()->set_target_estimated(true);
    line.port->send(line.message, line.agreement.generation, cancel);
    line.sent_for = simulation.step_number();
  }
}

// ------------------------------------------------------------------ implicit ports

void Coupler::start(Line& line, const Simulation& simulation) {
  line.fixed_point = FixedPoint(line.agreement.acceleration, line.agreement.relaxation);
  line.fixed_point.start();
  line.interface = line.port->model().applied(simulation);
  line.settled = false;
}

void Coupler::start_passes(const Simulation& simulation, bool again, const CancelToken& cancel) {
  for (Line& line : lines_) {
    if (!line.agreement.is_window()) continue;
    if (again) line.port->notify(false, simulation.step_number(), simulation.time(), cancel);
    start(line, simulation);
  }
}

void Coupler::start_iterations(Simulation& simulation) {
  announce_tangents(simulation);
  for (Line& line : lines_) {
    if (!line.agreement.is_tight()) continue;
    start(line, simulation);
    if (line.tangent < 0) continue;
    LoadTangent& tangent = simulation.load_tangent(line.tangent);
    tangent.stiffness.resize(0, 0);
    tangent.damping.resize(0, 0);
  }
}

// The pattern of the matrix follows who has tangents; it is made anew only when that changes.
void Coupler::announce_tangents(Simulation& simulation) {
  std::vector<std::pair<const Port*, int>> now;
  for (const Line& line : lines_)
    if (line.agreement.has_tangent()) now.emplace_back(line.port, line.agreement.generation);
  if (now == announced_) return;
  announced_ = std::move(now);
  std::vector<LoadTangent> tangents;
  for (Line& line : lines_) {
    line.tangent = line.agreement.has_tangent() ? static_cast<int>(tangents.size()) : -1;
    if (line.tangent >= 0) tangents.push_back(line.port->model().tangent(line.agreement));
  }
  simulation.set_load_tangents(std::move(tangents));
}

void Coupler::end_attempt(bool accepted, const Simulation& simulation, const CancelToken& cancel) {
  for (Line& line : lines_) {
    if (!line.agreement.is_tight()) continue;
    line.port->notify(accepted, simulation.step_number(), simulation.time(), cancel);
    start(line, simulation);
  }
}

void Coupler::apply_interface(const Line& line, Simulation& simulation) const {
  line.port->model().apply({line.interface.data(), line.interface.data() + line.interface.size()},
                           simulation);
}

void Coupler::apply_window(Simulation& simulation) const {
  for (const Line& line : lines_)
    if (line.agreement.is_window()) apply_interface(line, simulation);
}

// True: the answer is what is applied, within the tolerance.
bool Coupler::take_interface(Line& line, const CancelToken& cancel) {
  const auto answer = line.port->take(cancel);
  if (!answer) return true;  // the policy goes on with what was applied
  const Eigen::Map<const Eigen::VectorXd> given(answer->values.data(),
                                                static_cast<Eigen::Index>(answer->values.size()));
  const double change = (given - line.interface).norm();
  if (change <= line.agreement.tolerance * given.norm() || change == 0) return !answer->unfinished;
  line.interface = line.fixed_point.next(line.interface, given);
  return false;
}

// The answer belongs to the iterate and its derivatives are in the matrix: the solver's own test
// tells the end, as in a model that is not cut.
bool Coupler::take_with_tangent(Line& line, Simulation& simulation, const CancelToken& cancel) {
  auto answer = line.port->take(cancel);
  if (!answer) return true;
  line.interface = Eigen::Map<const Eigen::VectorXd>(
      answer->values.data(), static_cast<Eigen::Index>(answer->values.size()));
  apply_interface(line, simulation);
  if (answer->has_tangent) {
    LoadTangent& tangent = simulation.load_tangent(line.tangent);
    tangent.stiffness = std::move(answer->stiffness);
    tangent.damping = std::move(answer->damping);
  }
  return !answer->unfinished;
}

bool Coupler::exchange_window(const Simulation& simulation, int pass, const CancelToken& cancel) {
  const Stopwatch watch(waited_), exchange(exchanged_);
  ++exchanges_;
  for (Line& line : lines_) {
    if (!line.agreement.is_window()) continue;
    fill(line, simulation, simulation.time(), pass);
    line.port->send(line.message, line.agreement.generation, cancel);
  }
  bool agreed = true;
  for (Line& line : lines_)
    if (line.agreement.is_window()) agreed = take_interface(line, cancel) && agreed;
  return agreed;
}

bool Coupler::exchange_iteration(Simulation& simulation, int iteration, const CancelToken& cancel) {
  const Stopwatch watch(waited_), exchange(exchanged_);
  ++exchanges_;
  const auto takes_part = [&](const Line& line) {
    return line.agreement.is_tight() && iteration % line.agreement.every == 0;
  };
  for (Line& line : lines_) {
    if (!takes_part(line)) continue;
    fill(line, simulation, simulation.time(), iteration + 1);
    line.port->send(line.message, line.agreement.generation, cancel);
  }
  bool settled = true;
  for (Line& line : lines_) {
    if (line.tangent >= 0) {
      line.settled = takes_part(line) && take_with_tangent(line, simulation, cancel);
    } else if (takes_part(line)) {
      line.settled = take_interface(line, cancel);
      if (!line.settled) apply_interface(line, simulation);
    }
    settled = settled && (line.settled || !line.agreement.is_tight());
  }
  return settled;
}

void Coupler::notify(bool accepted, const Simulation& simulation, const CancelToken& cancel) {
  for (Line& line : lines_)
    if (line.agreement.is_implicit())
      line.port->notify(accepted, simulation.step_number(), simulation.time(), cancel);
}

}  // namespace mbcosim::server
