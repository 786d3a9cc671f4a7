/// All ports of one session, in step with it.
#pragma once

#include <memory>
#include <set>
#include <string>
#include <vector>

#include "coupling/fixed_point.h"
#include "coupling/input_history.h"
#include "coupling/port.h"
#include "mbcosim/v1/checkpoints.pb.h"

namespace mbcosim::server {

/// Order within step k (see `Coupling` in the proto):
///
///   explicit ports   prepare (state k−1) · exchange · apply · step · finish (staggered: state k);
///                    who has answered for step k is not asked again when it is repeated
///   tight ports      within the step, before each residual: exchange at the iterate · apply
///   window ports     passes: apply · step · exchange · test; redone from state k−1 until all agree
///
/// `prepare`, `apply` and `finish` touch the simulation and need the session's lock; `await_peers`
/// and `exchange` wait and need none.
class Coupler {
 public:
  /// `longest_wait`: for peers with policy WAIT. `recorder`: keeps what crosses the ports; may be
  /// null. `served`: names of ports of the deck that belong to somebody else. `optional`: all ports
  /// are, as those of streams.
  Coupler(const google::protobuf::RepeatedPtrField<v1::PortDefinition>& ports,
          const Simulation& simulation, std::chrono::milliseconds longest_wait,
          Recorder* recorder = nullptr, const std::set<std::string>& served = {},
          bool optional = false);

  Port* find(const std::string& name) const;
  const std::vector<std::unique_ptr<Port>>& ports() const { return ports_; }
  std::vector<v1::PortWait> waits() const;
  bool has_window() const;
  bool has_tight() const;

  void await_peers(const CancelToken& cancel);
  /// `length`: of the step [s]; `estimated`: it may become shorter.
  void prepare(const Simulation& simulation, double length, bool estimated);
  void exchange(const CancelToken& cancel);  ///< throws PeerLost, PeerRejected, as all exchanges do
  void apply(Simulation& simulation);
  /// Explicit ports whose loads follow their nodes: turns them to the present iterate.
  bool has_following() const;
  void turn_loads(Simulation& simulation) const;
  void finish(const Simulation& simulation, const CancelToken& cancel);
  /// The simulation went to another state: what peers answered before says nothing any more.
  void reset();

  /// What explicit ports remember, for a later process, and back: before the first step.
  google::protobuf::RepeatedPtrField<v1::CheckpointPort> memory() const;
  void take_over(const google::protobuf::RepeatedPtrField<v1::CheckpointPort>& memory);

  // --- window ports: redo the step
  /// `again`: the passes before agreed, but the step is done anew with another length; the peers
  /// are told that it is rejected.
  void start_passes(const Simulation& simulation, bool again, const CancelToken& cancel);
  void apply_window(Simulation& simulation) const;
  /// One exchange at the end of a pass. True: all interfaces agree. Throws PeerLost.
  bool exchange_window(const Simulation& simulation, int pass, const CancelToken& cancel);
  int maximum_passes() const;

  // --- tight ports: take part in the iteration
  void start_iterations(Simulation& simulation);
  /// One exchange at the iterate. True: the loads of all tight ports have settled. Throws PeerLost.
  bool exchange_iteration(Simulation& simulation, int iteration, const CancelToken& cancel);

  /// An attempt at the step failed and another follows, or a piece of it was accepted: tight peers
  /// are told, their iteration starts again.
  void end_attempt(bool accepted, const Simulation& simulation, const CancelToken& cancel);

  /// Tells window and tight peers how the step ended.
  void notify(bool accepted, const Simulation& simulation, const CancelToken& cancel);

  // --- since the last `start_clock`
  void start_clock() {
    waited_ = exchanged_ = 0;
    exchanges_ = 0;
  }
  double waited_seconds() const { return waited_; }  ///< for peers to come, and in exchanges
  int exchanges() const { return exchanges_; }       ///< with all peers at once
  double exchange_seconds() const { return exchanged_; }

 private:
  struct Line {  ///< what belongs to one port
    Port* port = nullptr;
    Agreement agreement;  ///< during the present step
    InputHistory history{1};
    v1::ServerMessage message;
    bool due = false;
    std::int64_t sent_for = -1;      ///< step whose motion is on its way; −1: none
    double target_time = 0;          ///< of the last message [s]
    std::int64_t answered_for = -1;  ///< explicit: step whose motion was answered; −1: none
    FixedPoint fixed_point{Acceleration::none, 1};
    Eigen::VectorXd interface;  ///< window, tight: values applied
    bool settled = false;       ///< tight: the last answer was what is applied
    int tangent = -1;           ///< tight: number among the simulation's load tangents; −1: none
  };
  void add(PortModel model, const Simulation& simulation);
  void claim(const PortModel& model, const Simulation& simulation);
  void fill(Line& line, const Simulation& simulation, double target_time, int iteration);
  static void take_agreement(Line& line, const Agreement& now);
  void take_answer(Line& line, const CancelToken& cancel);
  bool asks(const Line& line, std::int64_t step) const;
  void start(Line& line, const Simulation& simulation);
  void apply_interface(const Line& line, Simulation& simulation) const;
  bool take_interface(Line& line, const CancelToken& cancel);
  bool take_with_tangent(Line& line, Simulation& simulation, const CancelToken& cancel);
  void announce_tangents(Simulation& simulation);

  const std::chrono::milliseconds longest_wait_;
  Recorder* const recorder_;
  const bool optional_;
  std::vector<std::unique_ptr<Port>> ports_;
  std::set<int> written_;  ///< handles that ports write
  std::vector<Line> lines_;
  std::vector<std::pair<const Port*, int>>
      announced_;           ///< ports with tangents and their handshakes
  double target_time_ = 0;  ///< end of the step [s]
  double waited_ = 0, exchanged_ = 0;
  int exchanges_ = 0;
};

}  // namespace mbcosim::server
