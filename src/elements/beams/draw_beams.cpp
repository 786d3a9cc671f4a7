#include "elements/beams/beam.h"
#include "elements/drawing.h"

namespace mbcosim {

namespace {

template <int Nodes>
void draw_beam(const Beam<Nodes>& e, const EvalContext&, ElementGeometry& g) {
  std::vector<int> points;
  for (int k = 0; k < Nodes; ++k)
    points.push_back(g.point("point " + std::to_string(k + 1), e.node[k], e.offset[k]));
  g.line("reference line", std::move(points), /*curved=*/Nodes == 3);
}

}  // namespace

void draw_beams(Drawings& d) {
  d.add<Beam<2>>(draw_beam<2>);
  d.add<Beam<3>>(draw_beam<3>);
}

}  // namespace mbcosim
