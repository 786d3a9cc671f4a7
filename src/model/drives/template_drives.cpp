#include "model/drives/template_drives.h"

#include <algorithm>

namespace mbcosim {

template <int R, int C>
auto SumTplDrive<R, C>::value(const EvalContext& context) const -> Value {
  Value sum = Value::Zero();
  for (const Term& term : terms_) sum += term.entity * term.drive->value(context);
  return sum;
}

template <int R, int C>
bool SumTplDrive<R, C>::has_derivative() const {
  return std::all_of(terms_.begin(), terms_.end(),
                     [](const Term& term) { return term.drive->has_derivative(); });
}

template <int R, int C>
auto SumTplDrive<R, C>::derivative(const EvalContext& context) const -> Value {
  Value sum = Value::Zero();
  for (const Term& term : terms_)
    if (term.drive->has_derivative()) sum += term.entity * derivative_in_time(*term.drive, context);
  return sum;
}

template <int R, int C>
void SumTplDrive<R, C>::collect_followed(std::vector<NodeDof>& dofs) const {
  for (const Term& term : terms_) term.drive->collect_followed(dofs);
}

template <int R, int C>
void SumTplDrive<R, C>::write_slopes(const EvalContext& context, Value*& next) const {
  for (const Term& term : terms_) write_directed_slopes(context, *term.drive, term.entity, next);
}

template <int R, int C>
auto ComponentTplDrive<R, C>::value(const EvalContext& context) const -> Value {
  Value v = Value::Zero();
  for (int i = 0; i < R * C; ++i)
    if (drives_[i]) v(i) = drives_[i]->value(context);
  return v;
}

template <int R, int C>
bool ComponentTplDrive<R, C>::has_derivative() const {
  return std::all_of(drives_.begin(), drives_.end(),
                     [](const DrivePtr& d) { return !d || d->has_derivative(); });
}

template <int R, int C>
auto ComponentTplDrive<R, C>::derivative(const EvalContext& context) const -> Value {
  Value v = Value::Zero();
  for (int i = 0; i < R * C; ++i)
    if (drives_[i] && drives_[i]->has_derivative()) v(i) = derivative_in_time(*drives_[i], context);
  return v;
}

template <int R, int C>
void ComponentTplDrive<R, C>::collect_followed(std::vector<NodeDof>& dofs) const {
  for (const DrivePtr& d : drives_)
    if (d) d->collect_followed(dofs);
}

template <int R, int C>
void ComponentTplDrive<R, C>::write_slopes(const EvalContext& context, Value*& next) const {
  for (int i = 0; i < R * C; ++i) {
    Value direction = Value::Zero();
    direction(i) = 1;
    if (drives_[i]) write_directed_slopes(context, *drives_[i], direction, next);
  }
}

template class SumTplDrive<3>;
template class SumTplDrive<6>;
template class SumTplDrive<3, 3>;
template class SumTplDrive<6, 6>;
template class ComponentTplDrive<3>;
template class ComponentTplDrive<6>;
template class ComponentTplDrive<3, 3>;
template class ComponentTplDrive<6, 6>;

}  // namespace mbcosim
