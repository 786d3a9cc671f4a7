/// The `structural` card of the nodes block (MBDyn input manual, "Structural node").
#include "input/cards.h"
#include "input/deck.h"

namespace mbcosim {

namespace {

void read_assembly(DeckCard& card, StructuralNode& node) {
  if (!card.keyword("assembly")) return;
  node.assembly_position_stiffness =
      card.real("position stiffness", node.assembly_position_stiffness);
  node.assembly_velocity_stiffness =
      card.real("velocity stiffness", node.assembly_velocity_stiffness);
  if (node.assembly_position_stiffness < 0 || node.assembly_velocity_stiffness < 0)
    card.fail("the assembly stiffness must not be negative");
  if (node.is_displacement()) return;
  const std::string w = card.peek_word();
  if (card.more() && w != "scale" && w != "output" && w != "accelerations" && w != "outputinertia")
    node.omega_rotates = card.yes_no("omega rotates");
}

void read_node_output(DeckCard& card, StructuralNode& node) {
  Deck& deck = card.deck();
  if (card.keyword("output")) {
    if (card.keyword("default")) {
      node.output = deck.output.structural;
    } else if (card.keyword("accelerations")) {
      warn_old_name(card, card.last(), "accelerations, yes");
      node.output = node.accelerations = true;
    } else {
      node.output = card.yes_no("output");
    }
  }
}

/// `accelerations` and `output inertia` of dynamic and modal nodes, each at most once.
void read_dynamic_output(DeckCard& card, StructuralNode& node) {
  bool accelerations = false, inertia = false;
  while (card.more()) {
    if (card.keyword("accelerations")) {
      if (accelerations) card.fail("accelerations is given twice");
      accelerations = true;
      const std::string w = card.peek_word();
      node.accelerations =
          !card.more() || w == "outputinertia" ? true : card.yes_no("accelerations");
    } else if (card.keyword("output inertia")) {
      if (inertia) card.fail("output inertia is given twice");
      inertia = true;
      node.output_inertia = card.yes_no("output inertia");
    } else {
      return;
    }
  }
}

void read_prediction(DeckCard& card) {
  if (!card.keyword("prediction node")) return;
  card.structural_node(Card::NodeNeed::any);
  card.warn("a prediction node has no effect");
}

void read_configuration(DeckCard& card, StructuralNode& node) {
  card.keyword("position");
  node.x = card.absolute_position("position");
  if (node.has_rotation()) {
    card.keyword("orientation");
    node.R = card.absolute_orientation("orientation");
    if (card.keyword("orientation description")) node.description = card.orientation_description();
  }
  card.keyword("velocity");
  node.v = card.absolute_velocity("velocity", node.x);
  if (!node.has_rotation()) return;
  card.keyword("angular velocity");
  node.w = card.absolute_angular_velocity("angular velocity");
}

/// A node with a frame, dummy nodes included.
int frame_node(DeckCard& card) {
  const int node = card.structural_node(Card::NodeNeed::any);
  const StructuralNode& n = card.model().structural[node];
  if (n.is_displacement())
    card.fail("structural node " + std::to_string(n.label) +
              " is a displacement node; a node with orientation is needed here");
  return node;
}

void read_offset_dummy(DeckCard& card, StructuralNode& node) {
  card.keyword("position");
  node.offset = card.relative_position("offset", node.base);
  card.keyword("orientation");
  node.orientation = card.relative_orientation("orientation", node.base);
  if (card.keyword("orientation description")) node.description = card.orientation_description();
}

void read_relative_dummy(DeckCard& card, StructuralNode& node) {
  node.reference = frame_node(card);
  if (card.keyword("position")) node.offset = card.relative_position("position", node.reference);
  if (card.keyword("orientation")) {
    node.orientation = card.relative_orientation("orientation", node.reference);
    if (card.keyword("orientation description")) node.description = card.orientation_description();
  }
  if (!card.keyword("pivot node")) return;
  node.pivot = frame_node(card);
  if (card.keyword("position")) node.pivot_offset = card.relative_position("position", node.pivot);
  if (card.keyword("orientation"))
    node.pivot_orientation = card.relative_orientation("orientation", node.pivot);
}

/// Where a dummy node is follows at each use from where those are on which it depends.
void weigh_dummy(DeckCard& card, const StructuralNode& node) {
  std::unordered_map<int, Weight>& weights = card.deck().dummy_nodes;
  for (const int on : {node.base, node.reference, node.pivot}) {
    if (on < 0) continue;
    const int label = card.model().structural[on].label;
    card.refer("structural node " + std::to_string(label), weights[label]);
  }
  weights[node.label] = {card.weight().depth + 1, card.weight().objects + 1};
}

void read_dummy(DeckCard& card, StructuralNode& node) {
  node.base = frame_node(card);
  if (card.required("kind of dummy node", {"offset", "relative frame"}) == 0) {
    node.kind = StructuralKind::dummy_offset;
    read_offset_dummy(card, node);
  } else {
    node.kind = StructuralKind::dummy_relative;
    read_relative_dummy(card, node);
  }
  // As in MBDyn: where each node on which the dummy node depends has its accelerations written.
  const auto accelerated = [&](int on) {
    return on < 0 || card.model().structural[on].accelerations;
  };
  node.accelerations =
      accelerated(node.base) && accelerated(node.reference) && accelerated(node.pivot);
  weigh_dummy(card, node);
  if (card.peek_word() == "scale") card.fail_at(card.next(), "a dummy node has no scale");
  read_node_output(card, node);
}

/// A dummy node's configuration follows from its base.
void set_dummy_configuration(DeckCard& card, int index) {
  Model& model = card.model();
  const NodeState s = model.node_state(card.builder().input_context(), index);
  StructuralNode& node = model.structural[index];
  node.x = s.x;
  node.R = s.R;
  node.v = s.v;
  node.w = s.w;
}

}  // namespace

void read_structural_node(DeckCard& card, int label, StructuralNode node) {
  Deck& deck = card.deck();
  const ControlSettings& control = card.model().control;
  node.label = label;
  constexpr StructuralKind kKinds[] = {StructuralKind::static_,
                                       StructuralKind::dynamic,
                                       StructuralKind::modal,
                                       StructuralKind::static_displacement,
                                       StructuralKind::dynamic_displacement,
                                       StructuralKind::dummy_offset};
  const int kind = card.required("kind", {"static", "dynamic", "modal", "static displacement",
                                          "dynamic displacement", "dummy"});
  node.kind = kKinds[kind];
  node.description = control.orientation;
  node.output = deck.output.structural;
  node.scale = deck.structural_scale;
  node.assembly_position_stiffness = control.position_stiffness;
  node.assembly_velocity_stiffness = control.velocity_stiffness;
  node.omega_rotates = control.omega_rotates;
  if (node.is_dummy()) {
    read_dummy(card, node);
  } else {
    read_configuration(card, node);
    read_prediction(card);
    read_assembly(card, node);
    if (card.keyword("scale"))
      node.scale = card.keyword("default") ? deck.structural_scale : card.equation_scale();
    read_node_output(card, node);
    const bool moving = node.has_momentum() || node.kind == StructuralKind::modal;
    const bool accelerated = moving || deck.inverse_dynamics;
    node.accelerations |= accelerated && deck.output.accelerations;
    if (accelerated) read_dynamic_output(card, node);
  }
  card.expect_end();
  if (control.is_static && node.kind == StructuralKind::dynamic)
    node.kind = StructuralKind::static_;
  if (control.is_static && node.kind == StructuralKind::dynamic_displacement)
    node.kind = StructuralKind::static_displacement;
  const bool dummy = node.is_dummy();
  const int index = card.builder().add_structural(std::move(node));
  if (dummy) set_dummy_configuration(card, index);
}

}  // namespace mbcosim
