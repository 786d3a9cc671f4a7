/// Forces on scalar degrees of freedom. MBDyn input manual, "Abstract".
#pragma once

#include "elements/element.h"
#include "model/drive.h"

namespace mbcosim {

/// +d(t) in the equation of a degree of freedom; `internal` adds −d(t) to a second one. Structural
/// dofs 4–6 take moments about the global axes.
struct AbstractForce {
  NodeDof first, second;
  bool internal = false;
  DrivePtr d;  ///< force, moment, current, flow … of the dof
  LocalDof l1, l2;

  static constexpr int width = 12;

  void connect(Connector& c) {
    l1 = c.dof(first);
    if (internal) l2 = c.dof(second);
    c.drives(d);
  }
  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    const T f = u.drive(d);
    r.dof(l1, f);
    if (internal) r.dof(l2, -f);
  }
  void output(const Local<double>& u, OutputRow& row) const;
};

/// Label of the node that a degree of freedom belongs to.
int label_of(const Model& model, const NodeDof& dof);

}  // namespace mbcosim
