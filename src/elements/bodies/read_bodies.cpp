#include <Eigen/Eigenvalues>

#include "elements/bodies/body.h"
#include "elements/bodies/modal_node_body.h"
#include "elements/bodies/moving_frame.h"
#include "elements/bodies/readers.h"
#include "elements/families.h"
#include "model/card.h"
#include "model/inverse_problem.h"

namespace mbcosim {

void warn_about_inertia(Card& card, const Mat3& j) {
  if ((j - j.transpose()).norm() > 1e-9 * j.norm())
    card.warn("the inertia matrix is not symmetric");
  const Vec3 principal =
      Eigen::SelfAdjointEigenSolver<Mat3>(Mat3(0.5 * (j + j.transpose())), Eigen::EigenvaluesOnly)
          .eigenvalues();
  const double rounding = 1e-9 * j.norm();
  const auto moments = [&] {
    char text[80];
    std::snprintf(text, sizeof text, "principal moments %.6g, %.6g, %.6g", principal(0),
                  principal(1), principal(2));
    return std::string(text);
  };
  if (principal(0) < -rounding)
    card.warn("the inertia matrix is indefinite: " + moments(),
              "inertia is given about the centre of mass, not about the node");
  else if (principal(2) > principal(0) + principal(1) + rounding)
    card.warn("no body has this inertia: " + moments() +
                  "; none can be larger than the sum of the other two",
              "inertia is given about the centre of mass; check its axes and units");
}

namespace {

constexpr double kGravitationalConstant = 6.67384e-11;  ///< `G, si` [m³/(kg s²)], MBDyn's value

/// What stands before the masses: `[ condense, <number>, ] [ allow negative mass, ]`.
struct Masses {
  int count = 1;
  bool negative_allowed = false;
};

Masses read_masses(Card& card) {
  Masses r;
  if (card.keyword("condense")) {
    r.count = card.integer("number of condensed masses");
    if (r.count < 1)
      card.fail("the number of condensed masses must be at least 1, got " +
                std::to_string(r.count));
    if (card.keyword("variable mass"))
      card.fail("a body of variable mass cannot be condensed",
                "write a body for each variable mass; a node may have several");
  }
  r.negative_allowed = card.keyword("allow negative mass");
  return r;
}

double read_mass(Card& card, bool negative_allowed) {
  const double m = card.real("mass");
  if (m < 0 && !negative_allowed)
    card.fail("mass must not be negative, got " + std::to_string(m),
              "write `allow negative mass` before the mass if it is meant");
  return m;
}

/// mass, centre of mass, inertia about it [, {inertial | orientation}, axes]: one part of a
/// (condensed) body. Returns the place of the mass.
SourceSpan read_body_part(Card& card, bool negative_allowed, Body& body) {
  const double m = read_mass(card, negative_allowed);
  const SourceSpan where = card.last();
  const Vec3 x = card.relative_position("centre of mass", body.node);
  Mat3 j = card.relative_tensor("inertia", body.node);
  if (!negative_allowed) warn_about_inertia(card, j);
  if (card.one_of({"inertial", "orientation"}) >= 0 && !card.keyword("node")) {
    const Mat3 r = card.relative_orientation("inertial axes", body.node);
    j = r * j * r.transpose();
  }
  const Mat3 xx = cross<double>(x);
  body.m += m;
  body.S0 += m * x;
  body.J0 += j - m * xx * xx;
  body.centre = body.m != 0 ? Vec3(body.S0 / body.m) : x;
  return where;
}

void read_point_mass(Card& card, ElementInfo& info, int node) {
  const Masses masses = read_masses(card);
  PointMass body{node, 0};
  for (int i = 0; i < masses.count; ++i) body.m += read_mass(card, masses.negative_allowed);
  add_body(card, info, body);
}

void read_body(Card& card, ElementInfo& info) {
  const int node = card.structural_node(Card::NodeNeed::not_dummy);
  const StructuralNode& n = card.model().structural[node];
  if (card.keyword("variable mass")) {
    if (n.kind == StructuralKind::modal)
      card.fail("structural node " + std::to_string(n.label) +
                    " is a modal node; a body of variable mass cannot stand there",
                "hold a `dynamic` node to it by a `total joint` and put the body there");
    return read_variable_body(card, info, node);
  }
  if (n.kind == StructuralKind::static_displacement ||
      (n.kind == StructuralKind::static_ && !card.model().control.is_static &&
       !inverse_problem(card.model())))
    card.fail(
        "structural node " + std::to_string(n.label) + " is static; a body needs a dynamic node",
        n.is_displacement() ? "make the node `dynamic displacement`, or remove the body"
                            : "make the node `dynamic`, or remove the body");
  if (n.is_displacement()) return read_point_mass(card, info, node);
  const Masses masses = read_masses(card);
  Body body;
  body.node = node;
  SourceSpan where;
  for (int i = 0; i < masses.count; ++i)
    where = read_body_part(card, masses.negative_allowed, body);
  // One body of mass 0 adds inertia alone; of several, as in MBDyn, one has mass.
  if (masses.count > 1 && std::abs(body.m) < 2.2204460492503131e-16 && !masses.negative_allowed)
    card.fail_at(where, "the condensed mass is zero",
                 "give one of the bodies a mass, or write each as a body of its own");
  if (n.kind == StructuralKind::modal)
    add_general_element(card.builder(), info, std::make_unique<ModalNodeBody>(body));
  else
    add_body(card, info, std::move(body));
}

void read_gravity(Card& card, ElementInfo& info) {
  if (card.model().gravity)
    card.fail_at(info.where, "gravity is defined twice; at most one `gravity` card is allowed");
  Gravity g;
  if (card.keyword("central")) {
    if (card.keyword("origin")) g.origin = card.absolute_position("origin");
    if (!card.keyword("mass")) card.fail_expected("gravity: `mass` expected");
    const double mass = card.real("mass");
    if (!(mass > 0)) card.fail("gravity: the mass must be positive");
    if (!card.keyword("G")) card.fail_expected("gravity: `G` expected");
    const double big_g = card.keyword("si") ? kGravitationalConstant : card.real("G");
    if (!(big_g > 0)) card.fail("gravity: G must be positive");
    g.mass_g = mass * big_g;
  } else {
    if (!card.keyword("uniform"))
      card.warn_at(card.next(), "gravity: type missing, `uniform` assumed");
    g.uniform = card.vec3_drive("acceleration of gravity");
  }
  g.label = 1;             // the card has none; .grv has this one
  g.output = info.output;  // `default output`
  if (card.keyword("output")) g.output = card.yes_no("output");
  card.model().gravity = std::move(g);
}

}  // namespace

void register_bodies(Registry& registry) {
  registry.element("body", Family::body, read_body);
  registry.element("gravity", Family::gravity, read_gravity, false);
  register_inertia_cards(registry);
}

}  // namespace mbcosim
