/// Description of one readable value.
#pragma once

#include <string>
#include <vector>

namespace mbcosim {

enum class Causality { input, output, parameter, state };

/// One readable value of the model. Handles are indices into Simulation::variables().
struct Variable {
  std::string name;        ///< "node.structural.3.X", "joint.7.Fx", "abstract.11.x"
  int size = 1;            ///< number of doubles
  std::vector<int> shape;  ///< {} scalar, {3}, {3, 3} (by rows)
  std::string unit;        ///< SI: "m", "rad", "N"; empty: no unit
  std::string frame;       ///< "global", "node", or empty
  Causality causality = Causality::output;
  std::string description;
  std::string owner;  ///< "structural node 3 (tip)"
};

}  // namespace mbcosim
