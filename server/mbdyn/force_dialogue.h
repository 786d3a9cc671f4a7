/// The dialogue of one external force with its code: who says what when.
///
///   loose      start, and each step after prediction: 6 + state → loads
///   staggered  start, after the derivatives phase, after each step: 6 + state; the loads are read
///              at the first residual that follows
///   tight      each step, after prediction and after each correction: 2 + state → loads, until the
///              code says that it is done; the step does not end before
///   none       as staggered, nothing is read
///
/// The code answers 2 or 6 with loads, 4 alone to keep the last ones, 5 to end the run after this
/// step; in tight mode 2 asks for another exchange. Source: MBDyn input manual, external forces.
#pragma once

#include <chrono>
#include <functional>
#include <optional>
#include <string>

#include "mbdyn/force_message.h"
#include "mbdyn/force_port.h"

namespace mbcosim::mbdyn {

/// How states and loads travel: over a socket, or in files.
class ForceWire {
 public:
  virtual ~ForceWire() = default;
  virtual void send(Command command, const ForceState& state) = 0;
  /// What the peer says; loads only with kData and kLastData.
  virtual Command receive(ForceLoads& loads) = 0;
  /// Tells the peer, if it can be told; at most until then.
  virtual void end(std::chrono::steady_clock::time_point until) = 0;
};

class ForceDialogue {
 public:
  ForceDialogue(const DeckChannel& channel, ForcePort port, std::unique_ptr<ForceWire> wire);

  void start(const Simulation& simulation);  ///< at the initial state
  void step_begins();                        ///< a new step, or another attempt at it
  void attempt_failed();
  /// Before each residual, with the number of corrections; false: the code is not done.
  bool exchange(Simulation& simulation, int iteration, bool in_derivatives);
  void converged(const Simulation& simulation);  ///< of a step or the derivatives phase
  void end(std::chrono::steady_clock::time_point until) { wire_->end(until); }
  /// The code asked for the end of the run.
  bool wants_end() const { return wants_end_; }
  const std::string& name() const { return name_; }

 private:
  bool is_tight() const { return timing_.coupling == PortCoupling::tight; }
  bool sends_at(int iteration, bool in_derivatives) const;
  void send(const Simulation& simulation);
  void receive();

  const ChannelTiming timing_;
  const std::string name_;
  ForcePort port_;
  std::unique_ptr<ForceWire> wire_;
  std::optional<ForceLoads> loads_;  ///< last ones; none: the port's stay as they are
  bool awaiting_ = false;            ///< a state is on its way, its answer is not read
  bool exchanged_ = false;           ///< loose, staggered: in this step
  bool done_ = false;                ///< tight: the code is satisfied with this step
  bool wants_end_ = false;
};

}  // namespace mbcosim::mbdyn
