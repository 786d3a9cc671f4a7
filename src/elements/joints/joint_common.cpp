#include "elements/joints/joint_common.h"

namespace mbcosim {

Vec3 input_point(const Model& model, const Attachment& a) {
  const StructuralNode& node = model.structural[a.node];
  return node.x + node.R * a.f;
}

Attachment read_attachment(Card& card, bool displacement_too) {
  Attachment a;
  a.node =
      card.structural_node(displacement_too ? Card::NodeNeed::not_dummy : Card::NodeNeed::six_dof);
  return a;
}

void read_offset(Card& card, Attachment& a, const Attachment* other) {
  card.keyword("position");
  if (other) {
    const OtherNode first = other->as_other();
    a.f = card.relative_position("offset", a.node, &first);
  } else {
    a.f = card.relative_position("offset", a.node);
  }
}

void read_optional_offset(Card& card, Attachment& a, const Attachment* other) {
  if (card.peek_word() != "position") return;
  if (card.model().structural[a.node].is_displacement()) {
    card.fail_at(card.next(),
                 "an offset needs a node with an orientation, but structural node " +
                     std::to_string(card.model().structural[a.node].label) +
                     " is a displacement node",
                 "leave out `position` or use a static or dynamic node");
  }
  read_offset(card, a, other);
}

void read_optional_hinge(Card& card, Attachment& a, const Attachment* other) {
  if (card.one_of({"hinge", "orientation"}) < 0) return;
  if (other) {
    const OtherNode first = other->as_other();
    a.Rh = card.relative_orientation("hinge orientation", a.node, &first);
  } else {
    a.Rh = card.relative_orientation("hinge orientation", a.node);
  }
}

Attachment read_point_and_hinge(Card& card, const Attachment* other) {
  Attachment a = read_attachment(card);
  read_offset(card, a, other);
  read_optional_hinge(card, a, other);
  return a;
}

OrientationDescription read_description(Card& card) {
  if (card.keyword("orientation description")) return card.orientation_description();
  return card.model().control.orientation;
}

void require_not_parallel(Card& card, const Vec3& a, const Vec3& b, const char* joint) {
  constexpr double kParallel = 1e-14;
  if (a.cross(b).norm() > kParallel) return;
  card.fail(std::string(joint) +
                ": axis 3 of the first hinge is parallel to an axis of the second that must stay "
                "at a right angle to it",
            "check the hinge orientations of the two nodes");
}

std::string constraint_name(int k, int positions) {
  if (k < positions) return "position constraint " + std::to_string(k + 1);
  return "orientation constraint " + std::to_string(k - positions + 1);
}

}  // namespace mbcosim
