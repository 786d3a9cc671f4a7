/// A simulation whose motion is known, for tests of the parts of a session.
#pragma once

#include <memory>
#include <string>

#include "deck_simulation.h"

namespace mbcosim::server {

/// A mass of 2 kg at the origin with 1 m/s along x, and the force of parameter node 2 [N], 0 at
/// first, along x; steps of 1/8 s up to 1 s.
inline std::unique_ptr<Simulation> thrown_mass() {
  return simulation_of(
      "begin: data; problem: initial value; end: data;\n"
      "begin: initial value; initial time: 0.; final time: 1.; time step: .125; method: ms, 1.; "
      "tolerance: 1e-9; max iterations: 10; end: initial value;\n"
      "begin: control data; structural nodes: 1; rigid bodies: 1; forces: 1; parameter nodes: 1; "
      "end: control data;\n"
      "begin: nodes; structural: 1, dynamic displacement, null, 1., 0., 0.; parameter: 2, 0.; "
      "end: nodes;\n"
      "begin: elements; body: 1, 1, 2.; force: 1, absolute displacement, 1, 1., 0., 0., dof, 2, "
      "parameter, linear, 0., 1.; end: elements;\n");
}

}  // namespace mbcosim::server
