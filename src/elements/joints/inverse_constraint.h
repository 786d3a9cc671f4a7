/// Constraints of inverse dynamics: clamp, total joint, total pin joint.
#pragma once

#include <memory>
#include <vector>

#include "model/model.h"

namespace mbcosim {

/// One joint whose constraints hold (P) or whose multipliers act (T) in inverse dynamics. Rows are
/// the joint's own, in their order; positions x and rotations φ of its nodes are the columns.
class InverseConstraint {
 public:
  explicit InverseConstraint(ElementRef joint) : joint_(joint) {}
  virtual ~InverseConstraint() = default;

  ElementRef joint() const { return joint_; }
  int rows() const { return joint_.set->unknowns(joint_.index); }
  std::vector<int> nodes() const { return joint_.set->nodes(joint_.index); }
  /// J (rows × 6·nodes): directions are those of the first node at the end of the last record
  /// (`previous`, by structural node), arms the current ones.
  ///
  /// N.B. the reference solver takes the old directions in the stages of velocity, acceleration and
  /// forces, too, whose right hand sides have the current ones: errors of order h·w.
  virtual MatX jacobian(const EvalContext& context,
                        const std::vector<NodeRotationHistory>& previous) const = 0;
  /// Right hand sides of J δ, J (v, w) and J (a, ẇ).
  virtual VecX position(const EvalContext& context) const = 0;
  virtual VecX velocity(const EvalContext& context) const = 0;
  virtual VecX acceleration(const EvalContext& context) const = 0;
  /// At the end of a record in which its constraints held.
  virtual void accept(const EvalContext& context, State& state) const = 0;

 private:
  ElementRef joint_;
};

/// The constraint behind `joint`; null for joints that have none in inverse dynamics.
std::unique_ptr<InverseConstraint> inverse_constraint(ElementRef joint);

}  // namespace mbcosim
