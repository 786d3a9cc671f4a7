#include "elements/drawing.h"

namespace mbcosim {

namespace {

/// Of the element where its set holds several.
std::type_index type_of(const ElementRef& element) {
  const auto* general = dynamic_cast<const GeneralElementSet*>(element.set);
  return general ? typeid(general->element(element.index)) : typeid(*element.set);
}

}  // namespace

void Drawings::draw(const ElementRef& element, const EvalContext& context,
                    ElementGeometry& geometry) const {
  const auto found = draws_.find(type_of(element));
  if (found != draws_.end()) return found->second(*element.set, element.index, context, geometry);
  int k = 0;
  for (const int node : element.set->nodes(element.index))
    geometry.point("node " + std::to_string(++k), node);
}

std::vector<std::string> Drawings::arrow_names(const ElementRef& element) const {
  const auto found = arrows_.find(typeid(*element.set));
  return found == arrows_.end() ? std::vector<std::string>() : found->second.names;
}

Vec3 Drawings::arrow(const ElementRef& element, const EvalContext& context, int k) const {
  if (!element.set->is_active(*context.state, element.index)) return Vec3::Zero();
  return arrows_.at(typeid(*element.set)).value(*element.set, element.index, context, k);
}

const Drawings& all_drawings() {
  static const Drawings drawings = [] {
    Drawings d;
    draw_beams(d);
    draw_bodies(d);
    draw_electric(d);
    draw_forces(d);
    draw_hydraulics(d);
    draw_joints(d);
    draw_modal(d);
    return d;
  }();
  return drawings;
}

}  // namespace mbcosim
