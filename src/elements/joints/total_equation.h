/// Total equation and total internal reaction: constraint and reaction of a total joint on
/// different nodes.
#pragma once

#include <optional>

#include "elements/joints/total.h"

namespace mbcosim {

/// The constraint rows of a total joint (θ0 = θ_d, no remnant), whose multipliers act through a
/// total internal reaction.
///
///   unknowns    multipliers of the constrained components
///   rows        as TotalJoint on nodes 1, 2
///   loads       those of TotalJoint on the nodes 3, 4 of the reaction; none without a reaction
struct TotalEquation : NamedData<TotalEquation> {
  TotalJoint equation;
  std::optional<TotalJoint>
      reaction;  ///< set by the card of the reaction, which comes later in the deck

  static constexpr int width = 24;
  static constexpr AssemblyRole assembly = AssemblyRole::holonomic;
  static constexpr auto data_names = joined(kDisplacementData, kImposedAngleData);

  void connect(Connector& c) const {
    c.distinct_node(equation.first);
    c.distinct_node(equation.second);
    c.algebraic(equation.constraint.count());
  }
  template <class T>
  Vec<T> rotation_error(const Local<T>& u, const TotalJoint::Motion<T>& m) const {
    const Mat<T> error =
        m.rotation * rotation_of_vector(u.drive(equation.constraint.angle)).transpose();
    return vector_of_rotation(error);
  }
  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    const TotalConstraint& c = equation.constraint;
    const auto m = equation.motion(u);
    const Vec<T> xd = u.drive(c.displacement);
    c.rows<T>(u, r, m.position - xd, m.velocity - xd, rotation_error(u, m),
              m.spin - u.drive(c.angle));
    if (!reaction) return;
    Vec<T> force, moment;
    reaction->constraint.multipliers(u, force, moment);
    reaction->loads(r, reaction->motion(u, 2), force, moment, 2);
  }
  void assembly_residual(const Local<TimeDual>& u, Residual<TimeDual>& r) const;
  void output(const Local<double>& u, OutputRow& row) const;
  std::string log(const Model& model, int label) const;
  std::string row_name(int k) const { return equation.constraint.row_name(k); }
  bool constrains_velocity(int k) const { return equation.constraint.constrains_velocity(k); }
  double private_value(const Local<double>& u, int datum) const {
    const Vec3DrivePtr& drive =
        datum < 3 ? equation.constraint.displacement : equation.constraint.angle;
    return u.drive(drive)(datum % 3);
  }
};

/// The place where the multipliers of a total equation act. The equation itself applies the loads;
/// this element reports them.
struct TotalReaction {
  TotalJoint joint;
  ElementRef equation;
  int equation_label = 0;

  static constexpr int width = 12;

  void connect(Connector& c) const {
    c.distinct_node(joint.first);
    c.distinct_node(joint.second);
  }
  template <class T>
  void residual(const Local<T>&, Residual<T>&) const {}
  void tangent(const Local<double>&, Tangent&) const {}
  void output(const Local<double>& u, OutputRow& row) const;
  std::string log(const Model& model, int label) const;
};

void read_total_equation(Card& card, ElementInfo& info);
void read_total_reaction(Card& card, ElementInfo& info);

}  // namespace mbcosim
