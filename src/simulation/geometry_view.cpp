#include "simulation/geometry_view.h"

#include <algorithm>

#include "elements/drawing.h"

namespace mbcosim {

std::string variable_prefix(const ElementInfo& info) {
  std::string family = family_name(info.family);
  std::replace(family.begin(), family.end(), ' ', '_');
  return family + "." + std::to_string(info.label);
}

NodeGeometry GeometryView::node(int k) const {
  const StructuralNode& n = model_.structural[k];
  const NodeState state = model_.node_state(context_, k);
  NodeGeometry g{n.label, kind_name(n.kind), n.name, !n.is_displacement(),
                 state.x, Mat3::Identity()};
  if (g.oriented) g.R = state.R;
  return g;
}

ElementGeometry GeometryView::element(int k) const {
  ElementGeometry geometry;
  all_drawings().draw(model_.elements[k], context_, geometry);
  return geometry;
}

Vec3 GeometryView::position(const ElementGeometry::Point& point) const {
  if (point.node < 0) return point.offset;
  const NodeGeometry n = node(point.node);
  return n.x + n.R * point.offset;
}

std::vector<std::string> GeometryView::arrow_variables(int k) const {
  const ElementRef& e = model_.elements[k];
  std::vector<std::string> names = all_drawings().arrow_names(e);
  for (std::string& name : names) name = variable_prefix(e.set->info(e.index)) + "." + name;
  return names;
}

std::vector<std::string> GeometryView::amplitude_variables(
    int k, const ElementGeometry::Modes& modes) const {
  const ElementRef& e = model_.elements[k];
  std::vector<std::string> names = modes.amplitudes;
  for (std::string& name : names) name = variable_prefix(e.set->info(e.index)) + "." + name;
  return names;
}

std::vector<Vec3> GeometryView::trace(const ElementGeometry& geometry,
                                      const ElementGeometry::Line& line, int samples) const {
  std::vector<Vec3> x;
  for (const int p : line.points) x.push_back(position(geometry.points[p]));
  if (!line.curved || samples < 2) return x;
  std::vector<Vec3> along;
  for (int i = 0; i < samples; ++i) {
    const double xi = -1 + 2.0 * i / (samples - 1);
    along.push_back(x[0] * (xi * (xi - 1) / 2) + x[1] * (1 - xi * xi) + x[2] * (xi * (xi + 1) / 2));
  }
  return along;
}

}  // namespace mbcosim
