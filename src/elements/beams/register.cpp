#include <limits>
#include <string>

#include "elements/beams/beam.h"
#include "elements/registry.h"
#include "model/card.h"
#include "model/laws/law_parts.h"

namespace mbcosim {

namespace {

/// Section orientation from the nodes': relative to the second node, interpolated as rotation
/// parameters.
template <int Nodes>
Mat3 interpolated_orientation(const Model& model, const Beam<Nodes>& beam,
                              const typename Beam<Nodes>::Orientations& relative, int a) {
  const auto orientation = [&](int k) -> Mat3 {
    return model.structural[beam.node[k]].R * relative[k];
  };
  const Mat3 middle = orientation(1);
  Vec3 r = Vec3::Zero();
  for (int k = 0; k < Nodes; ++k)
    if (k != 1)
      r += BeamShape<Nodes>::n[a][k] * cgr_parameters<double>(middle.transpose() * orientation(k));
  return middle * cgr_rotation(r);
}

template <int Nodes>
void read_nodes(Card& card, Beam<Nodes>& beam, typename Beam<Nodes>::Orientations& relative) {
  for (int k = 0; k < Nodes; ++k) {
    beam.node[k] = card.structural_node();
    card.keyword("position");
    beam.offset[k] = card.relative_position("offset of the beam", beam.node[k]);
    relative[k].setIdentity();
    if (card.one_of({"orientation", "rot"}) >= 0)
      relative[k] = card.relative_orientation("orientation of the beam", beam.node[k]);
  }
}

/// `from nodes | [orientation,] R`; true when from the nodes.
template <int Nodes>
bool read_section_orientation(Card& card, Beam<Nodes>& beam,
                              const typename Beam<Nodes>::Orientations& relative, int a) {
  if (card.one_of({"from nodes", "from node", "node"}) >= 0) {
    beam.point[a].R0 = interpolated_orientation(card.model(), beam, relative, a);
    return true;
  }
  card.keyword("orientation");
  beam.point[a].R0 = card.absolute_orientation("section orientation");
  return false;
}

template <int Nodes>
void read_sections(Card& card, Beam<Nodes>& beam,
                   const typename Beam<Nodes>::Orientations& relative) {
  const bool from_nodes = read_section_orientation(card, beam, relative, 0);
  beam.point[0].law = card.law6();
  if constexpr (Nodes == 3) {
    if (!card.keyword("same"))
      read_section_orientation(card, beam, relative, 1);
    else if (from_nodes)
      beam.point[1].R0 = interpolated_orientation(card.model(), beam, relative, 1);
    else
      beam.point[1].R0 = beam.point[0].R0;
    if (card.keyword("same"))
      beam.point[1].law = copy_of(beam.point[0].law, card.builder());
    else
      beam.point[1].law = card.law6();
  }
  for (const auto& point : beam.point) beam.viscoelastic |= point.law->type() != LawType::elastic;
}

template <int Nodes>
void read_actuator(Card& card, Beam<Nodes>& beam) {
  if (!card.keyword("piezoelectric actuator")) return;
  const int count = card.integer("number of electrodes");
  if (count < 1 || count > Beam<Nodes>::max_actuators)
    card.fail("piezoelectric actuator: the number of abstract nodes must be between 1 and " +
              std::to_string(Beam<Nodes>::max_actuators) + ", got " + std::to_string(count));
  for (int i = 0; i < count; ++i) {
    beam.actuators.push_back(card.scalar_node(ScalarKind::abstract));
    const ScalarNode& n = card.model().scalars[beam.actuators.back()];
    if (!n.differential)
      card.fail("piezoelectric actuator: abstract node " + std::to_string(n.label) +
                " is algebraic; a differential one is needed");
  }
  beam.point[0].actuation = card.mat6xn("piezoelectric coefficients", count);
  if constexpr (Nodes == 3) {
    if (card.keyword("same"))
      beam.point[1].actuation = beam.point[0].actuation;
    else
      beam.point[1].actuation = card.mat6xn("piezoelectric coefficients", count);
  }
}

/// Flags that choose columns of self-describing formats; .act has fixed columns, so they are only
/// checked.
void read_custom_output(Card& card, bool viscoelastic) {
  if (!card.keyword("custom output")) return;
  const std::initializer_list<std::string_view> flags = {"position",
                                                         "orientation",
                                                         "configuration",
                                                         "force",
                                                         "moment",
                                                         "forces",
                                                         "linear strain",
                                                         "angular strain",
                                                         "strains",
                                                         "linear strain rate",
                                                         "angular strain rate",
                                                         "strain rates",
                                                         "all",
                                                         "none"};
  constexpr int kFirstRate = 9, kLastRate = 11;
  unsigned seen = 0;
  for (int flag = card.required("custom output flag", flags); flag >= 0;
       flag = card.one_of(flags)) {
    const std::string name(flags.begin()[flag]);
    if (seen & 1u << flag) card.fail("custom output: `" + name + "` is given twice");
    seen |= 1u << flag;
    if (name == "orientation" && card.keyword("orientation description"))
      card.orientation_description();
    if (flag >= kFirstRate && flag <= kLastRate && !viscoelastic)
      card.warn("custom output: `" + name + "` is ignored, the beam is elastic");
  }
}

template <int Nodes>
void read_beam(Card& card, ElementInfo& info) {
  info.type = Nodes == 2 ? "beam2" : "beam3";
  Beam<Nodes> beam;
  typename Beam<Nodes>::Orientations relative;
  read_nodes(card, beam, relative);
  read_sections(card, beam, relative);
  if (beam.set_geometry(card.model()) < std::numeric_limits<double>::epsilon())
    card.fail_at(
        info.where, "beam: the reference line has no length at an evaluation point",
        "place the nodes (with their offsets) at distinct points, in the order end, middle, end");
  read_actuator(card, beam);
  read_custom_output(card, beam.viscoelastic);
  add_element(card.builder(), info, std::move(beam));
}

}  // namespace

void register_beams(Registry& registry) {
  registry.element("beam2", Family::beam, read_beam<2>);
  registry.element("beam3", Family::beam, read_beam<3>);
  registry.element("beam", Family::beam, read_beam<3>);
}

}  // namespace mbcosim
