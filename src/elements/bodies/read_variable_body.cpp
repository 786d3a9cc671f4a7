/// Reader of `body, …, variable mass`.
#include "elements/bodies/moving_frame.h"
#include "elements/bodies/readers.h"
#include "model/card.h"

namespace mbcosim {

namespace {

void check_node(Card& card, const StructuralNode& node) {
  const bool is_static = card.model().control.is_static;
  if (node.kind == StructuralKind::dynamic || (node.kind == StructuralKind::static_ && is_static))
    return;
  card.fail("structural node " + std::to_string(node.label) + " is " + kind_name(node.kind) +
                "; a body of variable mass needs a dynamic node",
            node.is_displacement() ? "only nodes with an orientation have a body of variable mass"
                                   : "make the node `dynamic`, or remove the body");
}

/// A drive with a time derivative, which `read` reads.
template <class Read>
auto differentiable(Card& card, const std::string& what, Read read) {
  const SourceSpan where = card.more() ? card.next() : card.last();
  auto drive = read();
  if (!drive->has_derivative())
    card.fail_at(where, "the drive of the " + what + " has no time derivative",
                 "drives with one are e.g. const, linear, ramp, sine, piecewise linear and smooth "
                 "scalar functions; string, file and node drives have none");
  return drive;
}

}  // namespace

void read_variable_body(Card& card, ElementInfo& info, int node) {
  VariableBody body;
  body.node = node;
  const StructuralNode& n = card.model().structural[node];
  check_node(card, n);
  body.dynamic = n.has_momentum();
  if (card.keyword("allow negative mass"))
    card.fail("a variable mass must be positive", "remove `allow negative mass`");
  const SourceSpan mass = card.more() ? card.next() : card.last();
  body.m = differentiable(card, "mass", [&] { return card.drive("mass"); });
  const auto matrix = [&](const std::string& what) {
    return differentiable(card, what, [&] { return card.mat3_drive(what); });
  };
  const VectorAxes axes{card.model().structural[node].R, false};
  body.b = differentiable(card, "centre of mass",
                          [&] { return card.vec3_drive("centre of mass", axes); });
  body.J_vm = matrix("inertia that changes with the mass");
  body.J_vg = matrix("inertia that changes with the geometry");
  const EvalContext& start = card.builder().input_context();
  try {
    if (const double m = body.m->value(start); !(m > 0))
      card.fail_at(mass, "mass must be positive at the start, got " + std::to_string(m));
    body.initial = body.inertia(start, info.label);
  } catch (const EvaluationError& error) {
    card.fail_at(mass, error.what());
  }
  warn_about_inertia(card, body.initial.J());
  add_body(card, info, std::move(body));
}

}  // namespace mbcosim
