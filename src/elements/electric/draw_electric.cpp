#include "elements/drawing.h"
#include "elements/electric/electric.h"

namespace mbcosim {

void draw_electric(Drawings& d) {
  d.add<Accelerometer>([](const Accelerometer& e, const EvalContext&, ElementGeometry& g) {
    g.point("point", e.node, e.f);
  });
  d.add<DisplacementSensor>(
      [](const DisplacementSensor& e, const EvalContext&, ElementGeometry& g) {
        g.line("distance", {g.point("point 1", e.first, e.f1), g.point("point 2", e.second, e.f2)});
      });
  d.add<Motor>([](const Motor& e, const EvalContext&, ElementGeometry& g) {
    g.frame("stator", e.first, Vec3::Zero(), e.Rh);
    g.point("rotor", e.second);
  });
}

}  // namespace mbcosim
