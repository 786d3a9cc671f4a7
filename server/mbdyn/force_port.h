/// The engine's side of an external force: its kinematics as MBDyn sends them, the loads it takes.
#pragma once

#include <optional>
#include <vector>

#include "elements/ports/port_element.h"
#include "mbdyn/force_message.h"
#include "model/deck_channel.h"

namespace mbcosim::mbdyn {

class ForcePort {
 public:
  /// `channel`: of the simulation's model.
  ForcePort(const DeckChannel& channel, const Simulation& simulation);

  const ForceForm& form() const { return form_; }
  ForceForm& form() { return form_; }
  /// At the present state of the simulation, in the frame of the reference node when there is one.
  ForceState state(const Simulation& simulation) const;
  /// Loads of the peer, turned by the present orientation of the reference node, become inputs.
  void apply(const ForceLoads& loads, Simulation& simulation) const;

 private:
  void make_points(const StructuralPort& port, const Simulation& simulation,
                   const DeckChannel& channel);
  void make_modal(const ElementPort& port, const Simulation& simulation);
  std::vector<double> inputs(const ForceLoads& loads, const Mat3& R) const;

  ForceForm form_;
  std::optional<PointMotion> points_, reference_;
  const MappingMatrix* mapping_ = nullptr;  ///< mapped: H
  bool reference_loads_ = false, rotate_reference_loads_ = true;
  int input_ = -1, output_ = -1;  ///< handles
};

}  // namespace mbcosim::mbdyn
