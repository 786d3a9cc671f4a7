/// Positions, orientations, velocities and tensors given in reference frames (MBDyn input manual,
/// "Reference system").
///
/// Notation: x, R, v, w: origin, axes (local -> global), velocity and angular velocity of a frame,
/// global components.
#include <Eigen/Geometry>
#include <limits>

#include "input/deck.h"
#include "input/deck_card.h"
#include "model/model.h"

namespace mbcosim {

namespace {
constexpr double kUnitRoundoff = std::numeric_limits<double>::epsilon();
}

DeckCard::Frame DeckCard::node_frame(int node) const {
  if (node < 0) return {};
  const StructuralNode& n = deck_.builder.model().structural[node];
  return {n.x, n.R, n.v, n.w};
}

DeckCard::Frame DeckCard::frame_of_label() {
  const int l = label("reference frame label");
  const auto found = deck_.frames.find(l);
  if (found == deck_.frames.end()) fail_undefined(last(), "reference frame", l);
  const ReferenceFrame& f = deck_.builder.model().frames[found->second];
  return {f.x, f.R, f.v, f.w};
}

DeckCard::Reference DeckCard::reference_prefix(Entity entity, const OtherNode* other) {
  Reference r;
  if (!keyword("reference")) return r;
  constexpr Prefix kinds[] = {Prefix::global,         Prefix::node,
                              Prefix::local,          Prefix::other_node,
                              Prefix::other_position, Prefix::other_orientation};
  const int k =
      one_of({"global", "node", "local", "other node", "other position", "other orientation"});
  r.prefix = k < 0 ? Prefix::frame : kinds[k];
  if (k >= 3) {
    if (!other || entity == Entity::other)
      fail(k == 3   ? "\"other node\" is only allowed for the second node of an element"
           : k == 4 ? "\"other position\" is only allowed for the second node of an element"
                    : "\"other orientation\" is only allowed for the second node of an element");
    if (k == 4 && entity != Entity::position)
      fail("\"other position\" is only allowed for positions");
    if (k == 5 && entity != Entity::orientation)
      fail("\"other orientation\" is only allowed for orientations");
  }
  if (r.prefix == Prefix::frame) r.frame = frame_of_label();
  if (r.prefix == Prefix::local && entity != Entity::orientation)
    r.local = orientation("local frame");
  return r;
}

Vec3 DeckCard::absolute_position(std::string_view what, int context, const OtherNode* other) {
  need_argument(what);
  const Reference ref = reference_prefix(Entity::position, other);
  const Vec3 r = vec3(what);
  const Frame c = node_frame(context);
  switch (ref.prefix) {
    case Prefix::node:
      return c.x + c.R * r;
    case Prefix::local:
      return c.x + c.R * ref.local * r;
    case Prefix::frame:
      return ref.frame.x + ref.frame.R * r;
    case Prefix::other_node:
    case Prefix::other_position: {
      const Frame a = node_frame(other->node);
      return a.x + a.R * (ref.prefix == Prefix::other_node ? r : Vec3(other->offset + r));
    }
    default:
      return r;
  }
}

Mat3 DeckCard::absolute_orientation(std::string_view what, int context, const OtherNode* other) {
  need_argument(what);
  const Reference ref = reference_prefix(Entity::orientation, other);
  const Mat3 m = orientation(what);
  const Frame c = node_frame(context);
  switch (ref.prefix) {
    case Prefix::node:
    case Prefix::local:
      return c.R * m;
    case Prefix::frame:
      return ref.frame.R * m;
    case Prefix::other_node:
      return node_frame(other->node).R * m;
    case Prefix::other_orientation:
      return node_frame(other->node).R * other->orientation * m;
    default:
      return m;
  }
}

Vec3 DeckCard::absolute_velocity(std::string_view what, const Vec3& at) {
  need_argument(what);
  const Reference ref = reference_prefix(Entity::other, nullptr);
  const Vec3 v = vec3(what);
  switch (ref.prefix) {
    case Prefix::local:
      return ref.local * v;
    case Prefix::frame:
      return ref.frame.v + ref.frame.R * v + ref.frame.w.cross(at - ref.frame.x);
    default:
      return v;
  }
}

Vec3 DeckCard::absolute_angular_velocity(std::string_view what) {
  need_argument(what);
  const Reference ref = reference_prefix(Entity::other, nullptr);
  const Vec3 w = vec3(what);
  switch (ref.prefix) {
    case Prefix::local:
      return ref.local * w;
    case Prefix::frame:
      return ref.frame.w + ref.frame.R * w;
    default:
      return w;
  }
}

Vec3 DeckCard::absolute_vector(std::string_view what) { return free_vector(what, {}); }
Vec3 DeckCard::relative_vector(std::string_view what, int node) {
  return free_vector(what, {node_frame(node).R, false});
}

Vec3 DeckCard::free_vector(std::string_view what, const VectorAxes& axes) {
  need_argument(what);
  const Reference ref = reference_prefix(Entity::other, nullptr);
  const Vec3 u = vec3(what);
  const Mat3 from_global = axes.global ? Mat3(Mat3::Identity()) : Mat3(axes.R.transpose());
  const Mat3 from_axes = axes.global ? axes.R : Mat3(Mat3::Identity());
  switch (ref.prefix) {
    case Prefix::global:
      return from_global * u;
    case Prefix::node:
      return from_axes * u;
    case Prefix::local:
      return from_axes * ref.local * u;
    case Prefix::frame:
      return from_global * ref.frame.R * u;
    default:
      return u;
  }
}

Vec3 DeckCard::unit(std::string_view what, const Vec3& v) {
  const double norm = v.norm();
  if (!(norm * norm > kUnitRoundoff)) fail(std::string(what) + ": direction is null");
  if (std::abs(norm - 1) > kUnitRoundoff * 4)
    warn(std::string(what) + ": not a unit vector, normalised");
  return v / norm;
}

Vec3 DeckCard::relative_unit_vector(std::string_view what, int node) {
  return unit(what, relative_vector(what, node));
}
Vec3 DeckCard::absolute_unit_vector(std::string_view what, int context) {
  return unit(what, free_vector(what, {node_frame(context).R, true}));
}

Vec3 DeckCard::relative_position(std::string_view what, int node, const OtherNode* other) {
  need_argument(what);
  const Reference ref = reference_prefix(Entity::position, other);
  const Vec3 r = vec3(what);
  const Frame c = node_frame(node);
  const auto back = [&](const Vec3& global) { return Vec3(c.R.transpose() * (global - c.x)); };
  switch (ref.prefix) {
    case Prefix::global:
      return back(r);
    case Prefix::local:
      return ref.local * r;
    case Prefix::frame:
      return back(ref.frame.x + ref.frame.R * r);
    case Prefix::other_node:
    case Prefix::other_position: {
      const Frame a = node_frame(other->node);
      return back(a.x + a.R * (ref.prefix == Prefix::other_node ? r : Vec3(other->offset + r)));
    }
    default:
      return r;
  }
}

Mat3 DeckCard::relative_orientation(std::string_view what, int node, const OtherNode* other) {
  need_argument(what);
  const Reference ref = reference_prefix(Entity::orientation, other);
  const Mat3 m = orientation(what);
  const Mat3 back = node_frame(node).R.transpose();
  switch (ref.prefix) {
    case Prefix::global:
      return back * m;
    case Prefix::frame:
      return back * ref.frame.R * m;
    case Prefix::other_node:
      return back * node_frame(other->node).R * m;
    case Prefix::other_orientation:
      return back * node_frame(other->node).R * other->orientation * m;
    default:
      return m;
  }
}

Mat3 DeckCard::relative_tensor(std::string_view what, int node) {
  need_argument(what);
  Mat3 to = Mat3::Identity();  // value's frame -> node frame
  if (keyword("reference")) {
    const int k = one_of({"global", "node", "local"});
    const Mat3 back = node_frame(node).R.transpose();
    if (k == 0)
      to = back;
    else if (k < 0)
      to = back * frame_of_label().R;
  }
  return to * mat3(what) * to.transpose();
}

}  // namespace mbcosim
