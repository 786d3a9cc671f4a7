#include "elements/drawing.h"
#include "elements/hydraulic/actuator.h"

namespace mbcosim {

void draw_hydraulics(Drawings& d) {
  d.add<Actuator>([](const Actuator& e, const EvalContext&, ElementGeometry& g) {
    g.line("actuator", {g.point("cylinder", e.cylinder, e.f1), g.point("piston", e.piston, e.f2)});
  });
}

}  // namespace mbcosim
