/// What can be drawn of a model, and where it stands in a state.
#pragma once

#include <string>
#include <vector>

#include "model/geometry.h"
#include "model/model.h"

namespace mbcosim {

/// A structural node.
struct NodeGeometry {
  int label = 0;
  std::string kind;  ///< "dynamic", "static", …
  std::string name;
  bool oriented = true;       ///< false: a displacement node, R is the identity
  Vec3 x = Vec3::Zero();      ///< global [m]
  Mat3 R = Mat3::Identity();  ///< node -> global
};

/// Looks at a model in one state; both must outlive it.
class GeometryView {
 public:
  GeometryView(const Model& model, const State& state)
      : model_(model),
        context_(model.context(state, state.step == 0 ? Phase::derivatives : Phase::step)) {}

  NodeGeometry node(int k) const;  ///< k-th structural node
  /// Element k; nodes are indices, `EvaluationError` where a drive of it has no value.
  ElementGeometry element(int k) const;
  /// Where a point of an element is, global [m].
  Vec3 position(const ElementGeometry::Point& point) const;
  /// Names of the variables that hold the arrows of element k: "force.7.F".
  std::vector<std::string> arrow_variables(int k) const;
  /// Names of the variables that hold modal amplitudes.
  std::vector<std::string> amplitude_variables(int k, const ElementGeometry::Modes& modes) const;
  /// `samples` points, evenly spaced in ξ, along a line of an element: global [m], (3) each.
  /// Straight lines give their points.
  std::vector<Vec3> trace(const ElementGeometry& geometry, const ElementGeometry::Line& line,
                          int samples) const;

 private:
  const Model& model_;
  EvalContext context_;
};

/// "joint.7", "induced_velocity.2": what the names of an element's variables begin with.
std::string variable_prefix(const ElementInfo& info);

}  // namespace mbcosim
