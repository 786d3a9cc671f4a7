/// Ports that a deck declares: places where an external code applies loads to structural nodes.
#pragma once

#include <string>
#include <vector>

#include "math/rotation.h"
#include "math/types.h"

namespace mbcosim {

/// When a port's peer is asked, as the deck wishes; a peer may choose otherwise.
enum class PortCoupling { loose, staggered, tight };

/// `force: …, external structural`. Loads lie in State::memory: force [N] and moment about the
/// point [N·m] of each point, global components (6 × points), then, with `use_reference_loads`, the
/// total load on the reference node (6).
struct StructuralPort {
  std::string name;               ///< by which peers find it
  std::vector<int> nodes;         ///< structural node of each point (points)
  std::vector<Vec3> offsets;      ///< f: from the node to the point, node frame [m] (points)
  std::vector<int> point_labels;  ///< labels of the points (points)
  int reference = -1;  ///< structural node in whose frame motion and loads travel; −1: global
  bool use_reference_loads = false;  ///< the peer also gives the total load on the reference node
  bool accelerations = false;        ///< accelerations travel, too
  OrientationDescription orientation = OrientationDescription::matrix;
  PortCoupling coupling = PortCoupling::loose;
  int memory = -1;  ///< offset of the loads in State::memory

  int points() const { return static_cast<int>(nodes.size()); }
  int load_size() const { return 6 * (points() + (use_reference_loads ? 1 : 0)); }
};

}  // namespace mbcosim
