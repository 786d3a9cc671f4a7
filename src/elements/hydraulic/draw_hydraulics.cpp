#include "elements/drawing.h"
#include "elements/hydraulic/actuator.h"

namespace mbcosim {

namespace {

/// The two chambers, which share the cylinder's length: their pressures are those of their nodes.
void draw_actuator(const Actuator& e, const EvalContext& context, ElementGeometry& g) {
  const auto pressure = [&](int node) {
    return "node.hydraulic." + std::to_string(context.model->scalars[node].label) + ".x";
  };
  const int bottom = g.point("cylinder", e.cylinder, e.f1);
  const int piston = g.point("piston", e.piston, e.f2);
  const int head = g.point("head", e.cylinder, e.f1 + e.stroke * e.direction);
  g.lines.push_back({"chamber 1", {bottom, piston}, false, pressure(e.node1)});
  g.lines.push_back({"chamber 2", {piston, head}, false, pressure(e.node2)});
}

}  // namespace

void draw_hydraulics(Drawings& d) { d.add<Actuator>(draw_actuator); }

}  // namespace mbcosim
