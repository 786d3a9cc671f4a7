/// Readers of the elements that MBDyn has in run-time loaded modules.
#pragma once

#include "model/card.h"
#include "model/drive.h"

namespace mbcosim {

/// `[ help , ]`: the element's grammar, as a warning.
void read_help(Card& card, const char* grammar);

void read_wheel(Card& card, ElementInfo& info);
void read_inline_friction(Card& card, ElementInfo& info);
void read_asynchronous_machine(Card& card, ElementInfo& info);

/// d at x, with its derivative when x carries one.
template <class T>
T value_at(const Drive& d, const EvalContext& context, const T& x) {
  const double at = value_of(x);
  T r(d.value(context, at));
  if constexpr (!std::is_same_v<T, double>) {
    if (d.has_derivative()) r += (x - T(at)) * d.derivative(context, at);
  }
  return r;
}

}  // namespace mbcosim
