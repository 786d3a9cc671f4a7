#include "elements/families.h"

#include "elements/forces/abstract_force.h"
#include "elements/forces/structural_force.h"
#include "model/card.h"

namespace mbcosim {

namespace {

/// A fixed direction times a drive.
class DirectedDrive : public TplDrive<3, 1> {
 public:
  DirectedDrive(const Vec3& direction, DrivePtr magnitude)
      : direction_(direction), magnitude_(std::move(magnitude)) {}
  Vec3 value(const EvalContext& context) const override {
    return direction_ * magnitude_->value(context);
  }
  bool has_derivative() const override { return magnitude_->has_derivative(); }
  Vec3 derivative(const EvalContext& context) const override {
    return has_derivative() ? Vec3(direction_ * derivative_in_time(*magnitude_, context))
                            : Vec3::Zero();
  }
  void collect_followed(std::vector<NodeDof>& dofs) const override {
    magnitude_->collect_followed(dofs);
  }
  void write_slopes(const EvalContext& context, Vec3*& next) const override {
    write_directed_slopes(context, *magnitude_, direction_, next);
  }

 private:
  Vec3 direction_;
  DrivePtr magnitude_;
};

/// Axes of a drive's vectors: a follower's are those of its node, others are given in global ones.
VectorAxes drive_axes(Card& card, bool follower, int node) {
  return {card.model().structural[node].R, !follower};
}

/// The old syntax: `<direction>, <arm>, …, <drive>`.
Vec3 read_old_direction(Card& card, bool follower, int node) {
  card.warn_at(
      card.next(),
      "deprecated syntax: `position` is missing after the node; direction and arm are read",
      "write `position, <arm>, <direction>, <drive>`");
  return follower ? card.relative_unit_vector("direction", node)
                  : card.absolute_unit_vector("direction", node);
}

void read_force(Card& card, ElementInfo& info, bool follower) {
  StructuralForce e;
  e.follower = follower;
  e.node = card.structural_node();
  if (card.keyword("position")) {
    e.a = card.relative_position("arm", e.node);
    e.d = card.vec3_drive("force", drive_axes(card, follower, e.node));
  } else {
    const Vec3 direction = read_old_direction(card, follower, e.node);
    e.a = card.relative_position("arm", e.node);
    e.d = std::make_shared<DirectedDrive>(direction, card.drive("force"));
  }
  if (follower) e.relative_output = card.keyword("output relative");
  add_element(card.builder(), info, std::move(e));
}

void read_displacement_force(Card& card, ElementInfo& info) {
  StructuralForce e;
  e.displacement = true;
  e.node = card.structural_node(Card::NodeNeed::not_dummy);
  e.d = card.vec3_drive("force", drive_axes(card, false, e.node));
  add_element(card.builder(), info, std::move(e));
}

void read_internal_force(Card& card, ElementInfo& info, bool follower) {
  InternalForce e;
  e.follower = follower;
  e.first = card.structural_node();
  const bool position = card.keyword("position");
  Vec3 direction;
  if (!position) direction = read_old_direction(card, follower, e.first);
  e.a1 = card.relative_position("first arm", e.first);
  e.second = card.structural_node();
  if (position && !card.keyword("position"))
    card.fail_expected("`position` expected after the second node");
  const OtherNode other{e.first, e.a1};
  e.a2 = card.relative_position("second arm", e.second, &other);
  if (position)
    e.d = card.vec3_drive("force", drive_axes(card, follower, e.first));
  else
    e.d = std::make_shared<DirectedDrive>(direction, card.drive("force"));
  add_element(card.builder(), info, std::move(e));
}

void read_internal_displacement_force(Card& card, ElementInfo& info) {
  InternalForce e;
  e.displacement = true;
  e.first = card.structural_node(Card::NodeNeed::not_dummy);
  e.second = card.structural_node(Card::NodeNeed::not_dummy);
  e.d = card.vec3_drive("force", drive_axes(card, false, e.first));
  add_element(card.builder(), info, std::move(e));
}

/// `[position, <arm>]` of a couple, of no effect but in .log.
Vec3 read_unused_arm(Card& card, int node, const OtherNode* other = nullptr) {
  return card.keyword("position") ? card.relative_position("arm", node, other) : Vec3(Vec3::Zero());
}

void read_couple(Card& card, ElementInfo& info, bool follower) {
  info.type += " couple";
  StructuralCouple e;
  e.follower = follower;
  e.node = card.structural_node();
  e.a = read_unused_arm(card, e.node);
  e.d = card.vec3_drive("couple", drive_axes(card, follower, e.node));
  add_element(card.builder(), info, std::move(e));
}

void read_internal_couple(Card& card, ElementInfo& info, bool follower) {
  info.type += " couple";
  InternalCouple e;
  e.follower = follower;
  e.first = card.structural_node();
  e.a1 = read_unused_arm(card, e.first);
  e.second = card.structural_node();
  const OtherNode other{e.first, e.a1};
  e.a2 = read_unused_arm(card, e.second, &other);
  e.d = card.vec3_drive("couple", drive_axes(card, follower, e.first));
  add_element(card.builder(), info, std::move(e));
}

/// [position, f,] [force orientation, Rf,] [moment orientation, Rm,] of one node.
struct TotalEnd {
  Vec3 f = Vec3::Zero();
  Mat3 Rf = Mat3::Identity(), Rm = Mat3::Identity();
};
TotalEnd read_total_end(Card& card, int node, const OtherNode* other = nullptr) {
  TotalEnd e;
  if (card.keyword("position")) e.f = card.relative_position("position", node, other);
  OtherNode turned = other ? *other : OtherNode{};
  if (card.keyword("force orientation"))
    e.Rf = card.relative_orientation("force orientation", node, other ? &turned : nullptr);
  if (card.keyword("moment orientation"))
    e.Rm = card.relative_orientation("moment orientation", node, other ? &turned : nullptr);
  return e;
}

void read_total_drives(Card& card, Vec3DrivePtr& force, Vec3DrivePtr& moment) {
  const Vec3 zero = Vec3::Zero();
  force = card.keyword("force") ? card.vec3_drive("force") : make_constant_vec3_drive(zero);
  moment = card.keyword("moment") ? card.vec3_drive("moment") : make_constant_vec3_drive(zero);
}

void read_total_force(Card& card, ElementInfo& info) {
  TotalForce e;
  e.node = card.structural_node();
  const TotalEnd end = read_total_end(card, e.node);
  e.f = end.f;
  e.Rf = end.Rf;
  e.Rm = end.Rm;
  read_total_drives(card, e.df, e.dm);
  add_element(card.builder(), info, std::move(e));
}

void read_total_internal_force(Card& card, ElementInfo& info) {
  TotalInternalForce e;
  e.first = card.structural_node();
  const TotalEnd first = read_total_end(card, e.first);
  e.Rf = first.Rf;
  e.Rm = first.Rm;
  e.second = card.structural_node();
  const OtherNode other{e.first, first.f, first.Rf};
  e.f2 = read_total_end(card, e.second, &other).f;
  read_total_drives(card, e.df, e.dm);
  add_element(card.builder(), info, std::move(e));
}

/// A degree of freedom that has an equation to add to.
NodeDof read_loaded_dof(Card& card) {
  const SourceSpan where = card.next();
  const NodeDof dof = card.node_dof(false);
  if (!dof.structural && card.model().scalars[dof.node].kind == ScalarKind::parameter)
    card.fail_at(where, "parameter node " + std::to_string(label_of(card.model(), dof)) +
                            " has no equation to add a force to");
  if (dof.structural && card.model().structural[dof.node].is_dummy())
    card.fail_at(where, "structural node " + std::to_string(label_of(card.model(), dof)) +
                            " is a dummy node; it has no equations");
  if (dof.structural && dof.component >= 6)
    card.fail_at(where, "only the components 1 to 6 of a structural node take forces, got " +
                            std::to_string(dof.component + 1));
  return dof;
}

void read_abstract(Card& card, ElementInfo& info, bool internal) {
  AbstractForce e;
  e.first = read_loaded_dof(card);
  e.internal = internal;
  if (internal) e.second = read_loaded_dof(card);
  e.d = card.drive("force");
  add_element(card.builder(), info, std::move(e));
}

/// Binds the flag that tells two kinds of one card apart.
Registry::ElementReader kind(void (*read)(Card&, ElementInfo&, bool), bool flag) {
  return [read, flag](Card& card, ElementInfo& info) { read(card, info, flag); };
}

}  // namespace

void register_forces(Registry& registry) {
  const auto force = [&](std::initializer_list<std::string_view> words,
                         Registry::ElementReader reader) {
    registry.typed("force", Family::force, words, std::move(reader));
  };
  force({"absolute", "conservative"}, kind(read_force, false));
  force({"follower"}, kind(read_force, true));
  force({"absolute displacement"}, read_displacement_force);
  force({"absolute internal", "conservative internal"}, kind(read_internal_force, false));
  force({"follower internal"}, kind(read_internal_force, true));
  force({"absolute internal displacement"}, read_internal_displacement_force);
  force({"total"}, read_total_force);
  force({"total internal"}, read_total_internal_force);
  force({"abstract"}, kind(read_abstract, false));
  force({"abstract internal"}, kind(read_abstract, true));

  const auto couple = [&](std::initializer_list<std::string_view> words,
                          Registry::ElementReader reader) {
    registry.typed("couple", Family::force, words, std::move(reader));
  };
  couple({"absolute", "conservative"}, kind(read_couple, false));
  couple({"follower"}, kind(read_couple, true));
  couple({"absolute internal", "conservative internal"}, kind(read_internal_couple, false));
  couple({"follower internal"}, kind(read_internal_couple, true));
  couple({"total internal"}, read_total_internal_force);
}

}  // namespace mbcosim
