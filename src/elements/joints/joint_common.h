/// What the joints share: attachments to nodes, their readers, names of private data, lines of
/// .log, unwrapped angles.
#pragma once

#include <array>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include "elements/element.h"
#include "elements/joints/data_tables.h"
#include "elements/movable_part.h"
#include "model/card.h"

namespace mbcosim {

/// A point and a frame fixed to a node.
struct Attachment {
  int node = -1;               ///< structural node index
  Vec3 f = Vec3::Zero();       ///< offset of the point, in the node frame [m]
  Mat3 Rh = Mat3::Identity();  ///< orientation of the frame, relative to the node

  OtherNode as_other() const { return {node, f, Rh}; }
};

/// Point of an attachment in the input configuration, global [m].
Vec3 input_point(const Model& model, const Attachment& a);

// ------------------------------------------------------------------ readers
/// `<node>`; displacement nodes only when `displacement_too`.
Attachment read_attachment(Card& card, bool displacement_too = false);
/// `[ position , ] <f>`.
void read_offset(Card& card, Attachment& a, const Attachment* other = nullptr);
/// `[ position , <f> ]`.
void read_optional_offset(Card& card, Attachment& a, const Attachment* other = nullptr);
/// `[ { hinge | orientation } , <Rh> ]`.
void read_optional_hinge(Card& card, Attachment& a, const Attachment* other = nullptr);
/// `<node> , [position,] <f> [ , { hinge | orientation } , <Rh> ]`.
Attachment read_point_and_hinge(Card& card, const Attachment* other = nullptr);
/// `[ orientation description , <od> ]`; the default of the deck when absent.
OrientationDescription read_description(Card& card);
/// Refuses hinge frames in which the axes that the joint keeps at right angles are parallel.
void require_not_parallel(Card& card, const Vec3& a, const Vec3& b, const char* joint);

// ------------------------------------------------------------------ private data
/// Base of joints with a fixed table of private data, `Joint::data_names`.
template <class Joint>
struct NamedData {
  int private_datum(std::string_view name) const { return index_of(Joint::data_names, name); }
  std::vector<Datum> private_data() const { return data_of(Joint::data_names); }
};

/// Base of joints between two nodes with one attachment each.
struct TwoAttachments {
  Attachment a, b;
  void connect(Connector& c) const {
    c.distinct_node(a.node);
    c.distinct_node(b.node);
  }
  template <class T>
  Mat<T> hinge_a(const Local<T>& u) const {
    return u.R(0) * a.Rh.cast<T>();
  }
  template <class T>
  Mat<T> hinge_b(const Local<T>& u) const {
    return u.R(1) * b.Rh.cast<T>();
  }
  template <class T>
  Vec<T> arm_a(const Local<T>& u) const {
    return u.R(0) * a.f.cast<T>();
  }
  template <class T>
  Vec<T> arm_b(const Local<T>& u) const {
    return u.R(1) * b.f.cast<T>();
  }
  /// H1ᵀ H2.
  template <class T>
  Mat<T> relative_rotation(const Local<T>& u) const {
    return mbcosim::relative_rotation<T>(hinge_a(u), hinge_b(u));
  }
};

// ------------------------------------------------------------------ hints of `driven`
/// The attachments of a joint between two nodes, such that points and frames coincide.
template <class E>
constexpr MovablePart<E> movable_offset1() {
  return {"offset{1}", 3, [](E& e) { return e.a.f.data(); },
          [](E& e, const Local<double>& u) {
            e.a.f = u.R(0).transpose() * (u.x(1) + e.arm_b(u) - u.x(0));
          }};
}
template <class E>
constexpr MovablePart<E> movable_offset2() {
  return {"offset{2}", 3, [](E& e) { return e.b.f.data(); },
          [](E& e, const Local<double>& u) {
            e.b.f = u.R(1).transpose() * (u.x(0) + e.arm_a(u) - u.x(1));
          }};
}
template <class E>
constexpr MovablePart<E> movable_hinge1() {
  return {"hinge{1}", 9, [](E& e) { return e.a.Rh.data(); },
          [](E& e, const Local<double>& u) { e.a.Rh = u.R(0).transpose() * e.hinge_b(u); }};
}
template <class E>
constexpr MovablePart<E> movable_hinge2() {
  return {"hinge{2}", 9, [](E& e) { return e.b.Rh.data(); },
          [](E& e, const Local<double>& u) { e.b.Rh = u.R(1).transpose() * e.hinge_a(u); }};
}
template <class E>
constexpr std::array<MovablePart<E>, 2> movable_points() {
  return {movable_offset1<E>(), movable_offset2<E>()};
}
template <class E>
constexpr std::array<MovablePart<E>, 2> movable_hinges() {
  return {movable_hinge1<E>(), movable_hinge2<E>()};
}
template <class E>
constexpr std::array<MovablePart<E>, 4> movable_points_and_hinges() {
  return {movable_offset1<E>(), movable_offset2<E>(), movable_hinge1<E>(), movable_hinge2<E>()};
}

// ------------------------------------------------------------------ .log
/// A line of .log: general notation with six digits.
class LogLine {
 public:
  LogLine(const char* type, int label) { text_ << type << ": " << label; }
  LogLine& node(const Model& model, int index) {
    text_ << ' ' << model.structural[index].label;
    return *this;
  }
  LogLine& add(const Vec3& v) { return numbers(v.data(), 3); }
  LogLine& add(const Mat3& m) {
    const Mat3 by_rows = m.transpose();
    return numbers(by_rows.data(), 9);
  }
  LogLine& add(int value) {
    text_ << ' ' << value;
    return *this;
  }
  /// node, offset, orientation.
  LogLine& add(const Model& model, const Attachment& a) {
    return node(model, a.node).add(a.f).add(a.Rh);
  }
  /// node, then the pin X₀, R₀ as MBDyn writes it: Rᵀ (X₀ − x), R₀ Rᵀ of the node as read.
  LogLine& pin(const Model& model, int index, const Vec3& X0, const Mat3& R0) {
    const StructuralNode& n = model.structural[index];
    const Mat3 Rt = n.R.transpose();
    return node(model, index).add(Vec3(Rt * (X0 - n.x))).add(Mat3(R0 * Rt));
  }
  /// node, offset.
  LogLine& point(const Model& model, const Attachment& a) { return node(model, a.node).add(a.f); }
  std::string str() const { return text_.str(); }

 private:
  LogLine& numbers(const double* data, int count) {
    for (int i = 0; i < count; ++i) text_ << ' ' << data[i] + 0.0;
    return *this;
  }
  std::ostringstream text_;
};

// ------------------------------------------------------------------ angles and constraints
/// Angle about axis 3 that counts turns. Memory: the angle in (−π, π] at the last accepted step,
/// the turns done.
struct UnwrappedAngle {
  static constexpr int memory = 2;
  static double turns(double angle, double previous, double turns) {
    if (angle - previous < -kPi) return turns + 1;
    if (angle - previous > kPi) return turns - 1;
    return turns;
  }
  static double value(const Local<double>& u, int offset, double angle) {
    return angle + 2 * kPi * turns(angle, u.memory(offset), u.memory(offset + 1));
  }
  static void accept(const Local<double>& u, State& state, int offset, double angle) {
    double* memory = &state.memory[u.memory_offset() + offset];
    memory[1] = turns(angle, memory[0], memory[1]);
    memory[0] = angle;
  }
};

/// Name of constraint row k for joints whose first `positions` rows concern positions.
std::string constraint_name(int k, int positions);

}  // namespace mbcosim
