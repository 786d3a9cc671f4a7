/// Motion of points that are fixed to structural nodes, from the variables of a simulation.
#pragma once

#include <vector>

#include "math/types.h"
#include "model/structural_port.h"
#include "simulation/simulation.h"

namespace mbcosim {

/// Global components, unless relative to a reference: then those of its frame.
struct PointState {
  Vec3 x = Vec3::Zero();  ///< position [m]
  Mat3 R = Mat3::Identity();
  Vec3 v = Vec3::Zero(), w = Vec3::Zero();   ///< velocity [m/s], angular velocity [rad/s]
  Vec3 a = Vec3::Zero(), wp = Vec3::Zero();  ///< their rates; zero for nodes that have none
};

/// As an observer on `reference` sees the point, in the reference's frame.
PointState relative_to(const PointState& reference, const PointState& point);

/// Points k fixed to nodes n at f (node frame): x = x_n + R_n f, v = v_n + ω_n × R_n f, …
class PointMotion {
 public:
  /// Points of structural nodes (indices) at offsets.
  PointMotion(const Simulation& simulation, const std::vector<int>& nodes,
              const std::vector<Vec3>& offsets);
  PointMotion(const Simulation& simulation, const StructuralPort& port)
      : PointMotion(simulation, port.nodes, port.offsets) {}
  int size() const { return static_cast<int>(points_.size()); }
  PointState at(const Simulation& simulation, int k) const;

  /// Where the motion comes from.
  struct Point {
    int x, R, v, w, a, wp;  ///< handles of the node's variables; −1: it has none
    Vec3 offset;            ///< node frame [m]
  };
  const Point& point(int k) const { return points_[k]; }

 private:
  std::vector<Point> points_;
};

/// null: the model has no structural port of this name.
const StructuralPort* find_structural_port(const Model& model, const std::string& name);

}  // namespace mbcosim
