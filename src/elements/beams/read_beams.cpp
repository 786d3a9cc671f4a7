#include <limits>
#include <string>

#include "elements/beams/beam.h"
#include "elements/beams/beam_slider.h"
#include "elements/beams/helicoidal_beam.h"
#include "elements/families.h"
#include "model/card.h"
#include "model/laws/law_parts.h"

namespace mbcosim {

namespace {

/// Section orientation from the nodes': relative to the second node, interpolated as rotation
/// parameters.
template <int Nodes>
Mat3 interpolated_orientation(Card& card, const Beam<Nodes>& beam,
                              const typename Beam<Nodes>::Orientations& relative, int a) {
  const auto orientation = [&](int k) -> Mat3 {
    return card.model().structural[beam.node[k]].R * relative[k];
  };
  const Mat3 middle = orientation(1);
  Vec3 r = Vec3::Zero();
  for (int k = 0; k < Nodes; ++k) {
    if (k == 1) continue;
    const Mat3 turn = middle.transpose() * orientation(k);
    if (is_half_turn(turn))
      card.fail("beam: its nodes " + std::to_string(k + 1) +
                    " and 2 are turned by half a revolution against each other",
                "`from nodes` interpolates rotations; give the orientation of the section");
    r += BeamShape<Nodes>::n[a][k] * cgr_parameters<double>(turn);
  }
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
    beam.point[a].R0 = interpolated_orientation(card, beam, relative, a);
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
      beam.point[1].R0 = interpolated_orientation(card, beam, relative, 1);
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

/// Fields of self-describing formats: the beam's own choice or the deck's.
BeamOutput read_custom_output(Card& card, bool viscoelastic) {
  BeamOutput output;
  if (const auto* deck = dynamic_cast<const BeamOutputDefault*>(&card))
    output = deck->default_beam_output();
  if (card.keyword("custom output")) output = read_beam_output(card, "custom output", viscoelastic);
  if (!viscoelastic) output.chosen &= ~BeamOutput::rates;
  return output;
}

template <int Nodes>
void check_geometry(Card& card, const ElementInfo& info, Beam<Nodes>& beam) {
  constexpr double kTiny = std::numeric_limits<double>::epsilon();
  const char* const remedy =
      "place the nodes (with their offsets) at distinct points, in the order end, middle, end";
  const auto X = [&](int k) -> Vec3 {
    const StructuralNode& n = card.model().structural[beam.node[k]];
    return n.x + n.R * beam.offset[k];
  };
  for (int k = 1; k < Nodes; ++k)
    if ((X(k) - X(k - 1)).squaredNorm() < kTiny)
      card.fail_at(info.where,
                   "beam: its points " + std::to_string(k) + " and " + std::to_string(k + 1) +
                       " are in one place",
                   remedy);
  if (beam.set_geometry(card.model()) < kTiny)
    card.fail_at(info.where, "beam: the reference line has no length at an evaluation point",
                 remedy);
  const Vec3 chord = X(Nodes - 1) - X(0);
  for (const auto& point : beam.point)
    if ((point.R0 * point.l0).dot(chord) <= 0)
      card.fail_at(info.where, "beam: the reference line turns back at an evaluation point",
                   remedy);
}

/// Stiffnesses that are not positive leave a beam without resistance or make it unstable.
template <int Nodes>
void warn_of_soft_section(Card& card, const Beam<Nodes>& beam, int a) {
  const Law<6>& law = *beam.point[a].law;
  if (law.type() == LawType::viscous) return;
  Law<6>::Response r;
  try {
    law.respond(card.builder().input_context(), Vec6::Zero(), Vec6::Zero(), true, r);
  } catch (const EvaluationError&) {
    return;  // it depends on what is not known yet
  }
  for (int i = 0; i < 6; ++i)
    if (!(r.de(i, i) > 0)) {
      card.warn("beam: stiffness " + std::to_string(i + 1) +
                " of 6 is not positive: " + std::to_string(r.de(i, i)));
      return;
    }
}

template <int Nodes>
void read_beam(Card& card, ElementInfo& info) {
  info.type = Nodes == 2 ? "beam2" : "beam3";
  Beam<Nodes> beam;
  typename Beam<Nodes>::Orientations relative;
  read_nodes(card, beam, relative);
  read_sections(card, beam, relative);
  check_geometry(card, info, beam);
  for (int a = 0; a < beam.points; ++a) warn_of_soft_section(card, beam, a);
  read_actuator(card, beam);
  beam.fields = read_custom_output(card, beam.viscoelastic);
  add_element(card.builder(), info, std::move(beam));
}

}  // namespace

void register_beams(Registry& registry) {
  registry.element("beam2", Family::beam, read_beam<2>);
  registry.element("beam3", Family::beam, read_beam<3>);
  registry.element("beam", Family::beam, read_beam<3>);
  registry.element("hbeam", Family::beam, read_helicoidal_beam);
  registry.typed("joint", Family::joint, {"beam slider"}, read_beam_slider);
}

}  // namespace mbcosim
