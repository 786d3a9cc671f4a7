/// An FMU as a peer of a signal port.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "client/mbcosim_client.h"
#include "peer/controller.h"

namespace mbcosim::peer {

/// Signals of a port, one for each number: a variable of several numbers is "name[1]", "name[2]", …
struct PortSignals {
  std::vector<std::string> outputs;  ///< that the simulation sends
  std::vector<std::string> inputs;   ///< that it takes
};

/// Which number of the FMU goes with each signal.
struct SignalMap {
  struct Source {
    int signal = -1;   ///< its place among the signals sent; -1: nothing sets the number
    double start = 0;  ///< what it keeps then
  };
  std::vector<std::uint32_t> inputs;   ///< of the FMU, that are set
  std::vector<Source> sources;         ///< of all their numbers
  std::vector<std::uint32_t> outputs;  ///< of the FMU, that are read
  std::size_t output_size = 0;         ///< numbers of all of them
  std::vector<int> targets;            ///< places among those, in the order of the signals taken
  /// Inputs of the FMU that nothing sets, with the start values that they keep.
  std::map<std::string, std::string> unset;
};

/// By equal names, or as `map` says (name in the FMU -> name of the signal). Numbers of an array
/// are "name[1]", "name[2]", … row by row; the name of an array and that of a variable of the
/// simulation stand for all their numbers. Throws std::runtime_error when a name is unknown, a
/// signal that the simulation takes has no source, or an input of the FMU has neither a signal nor
/// a start value.
SignalMap map_signals(const FmuArchive& archive, const PortSignals& signals,
                      const std::map<std::string, std::string>& map);

/// Advances the FMU with the simulation: at each exchange inputs are set and the FMU steps to the
/// time for which an answer is wanted. A step that is asked for again starts from the state before
/// it, which is the only one kept: there is no way back to what lies before.
class FmuPeer {
 public:
  /// `time`: of the simulation now [s]; the FMU starts there.
  FmuPeer(Controller& controller, SignalMap map, bool keeps_states, double time);
  /// Throws Lost when the FMU cannot go on, std::runtime_error when the step alone has failed: the
  /// FMU then stands at its beginning.
  std::vector<double> exchange(const client::Motion& motion);
  /// An implicit step ended: accepted, or to be redone from the end of step `step`.
  void step_ended(bool accepted, std::int64_t step);

 private:
  bool is_before_kept(const client::Motion& motion, double target) const;
  void enter_step(const client::Motion& motion, double target);
  std::vector<double> advance(const client::Motion& motion, double target);
  void begin_step();
  void go_back();

  Controller& controller_;
  const SignalMap map_;
  const bool keeps_states_;
  bool in_step_ = false;    ///< an implicit step has begun and not ended
  bool kept_ = false;       ///< the state before the last step is kept
  std::int64_t step_ = -1;  ///< of the last exchange
  double time_, before_;    ///< of the FMU, and of its state before the step [s]
};

}  // namespace mbcosim::peer
