/// Value and rate of a degree of freedom inside an element, whatever order it was given with.
#pragma once

#include "elements/element.h"

namespace mbcosim {

template <class T>
T dof_position(const Local<T>& u, const LocalDof& d) {
  return d.scalar >= 0 ? u.scalar(d.scalar) : u.x(d.node)(d.component);
}

template <class T>
T dof_rate(const Local<T>& u, const LocalDof& d) {
  if (d.scalar >= 0) return u.scalar_rate(d.scalar);
  return d.component < 3 ? u.v(d.node)(d.component) : u.w(d.node)(d.component - 3);
}

/// Index of the unknown behind a dof in State::y; -1 for rotations and parameter nodes.
inline int unknown_of(const Model& model, const NodeDof& d) {
  if (!d.structural) return model.scalars[d.node].unknown;
  return d.component < 3 ? model.structural[d.node].first + d.component : -1;
}

}  // namespace mbcosim
