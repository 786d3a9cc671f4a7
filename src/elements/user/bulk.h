#pragma once

#include "elements/element.h"
#include "model/drive.h"

namespace mbcosim {

/// Spring between a degree of freedom and the ground: −k(t) y in the row of y.
struct BulkSpringSupport {
  NodeDof dof;
  DrivePtr stiffness;
  LocalDof y;

  static constexpr int width = 6;
  void connect(Connector& c) { y = c.dof(dof); }
  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    r.dof(y, u.dof(y) * -u.drive(stiffness));
  }
};

}  // namespace mbcosim
