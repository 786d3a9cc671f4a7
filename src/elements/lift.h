/// The same view of a state in numbers that carry derivatives: by Newton increments (`Dual`) or by
/// time (`TimeDual`).
#pragma once

#include "elements/element_view.h"

namespace mbcosim::detail {

/// Dual numbers come in a few widths, so that element types share instantiations.
constexpr int dual_width(int columns) {
  return columns <= 6 ? 6 : columns <= 12 ? 12 : columns <= 18 ? 18 : 24;
}

template <class T>
void lift_values(const LocalNode<double>& from, LocalNode<T>& to) {
  to.x = from.x.template cast<T>();
  to.v = from.v.template cast<T>();
  to.w = from.w.template cast<T>();
  to.R = from.R.template cast<T>();
}

/// Values with derivatives with respect to the local columns start .. start + D::directions − 1;
/// `parameters`: g and ġ, too.
template <bool parameters, class D>
void lift(const Local<double>& u, const NodeSeeds* seeds, int start, Local<D>& l) {
  const Connection& c = *u.connection;
  const double cc = u.context->seed;
  const auto slot_of = [&](int column) {
    const int j = column - start;
    return j >= 0 && j < D::directions ? j : -1;
  };
  l.context = u.context;
  l.connection = u.connection;
  l.info = u.info;
  for (int k = 0; k < c.node_count; ++k) {
    LocalNode<D>& n = l.nodes[k];
    const LocalNode<double>& m = u.nodes[k];
    lift_values(m, n);
    if constexpr (parameters) {
      n.g = m.g.template cast<D>();
      n.gp = m.gp.template cast<D>();
    }
    const NodeSeeds& seed = seeds[c.node[k]];
    for (int i = 0; i < 3; ++i) {
      if (const int j = slot_of(6 * k + i); j >= 0) {
        n.x(i).d[j] = cc;
        n.v(i).d[j] = 1;
      }
      if (const int j = slot_of(6 * k + 3 + i); j >= 0) {
        const Mat3 dR = cross<double>(seed.A.col(i)) * m.R;
        for (int q = 0; q < 9; ++q) n.R(q).d[j] = dR(q);
        for (int q = 0; q < 3; ++q) n.w(q).d[j] = seed.B(q, i);
        if constexpr (parameters) {
          n.g(i).d[j] = cc;
          n.gp(i).d[j] = 1;
        }
      }
    }
  }
  const int s0 = 6 * c.node_count;
  for (int i = 0; i < c.scalar_count; ++i) {
    l.scalar_values[i] = D(u.scalar_values[i]);
    l.scalar_rates[i] = D(u.scalar_rates[i]);
    if (const int j = slot_of(s0 + i); j >= 0) {
      const bool differential = u.context->model->scalars[c.scalar[i]].differential;
      l.scalar_values[i].d[j] = differential ? cc : 1;
      l.scalar_rates[i].d[j] = differential ? 1 : 0;
    }
  }
  const int o0 = s0 + c.scalar_count;
  for (int i = 0; i < c.own_count; ++i) {
    l.own_values[i] = D(u.own_values[i]);
    l.own_rates[i] = D(u.own_rates[i]);
    if (const int j = slot_of(o0 + i); j >= 0) {
      l.own_values[i].d[j] = c.own_differential[i] ? cc : 1;
      l.own_rates[i].d[j] = c.own_differential[i] ? 1 : 0;
    }
  }
}

/// Positions, orientations and own unknowns with their rates.
inline void lift_in_time(const Local<double>& u, Local<TimeDual>& t) {
  const Connection& c = *u.connection;
  t.context = u.context;
  t.connection = u.connection;
  t.info = u.info;
  for (int k = 0; k < c.node_count; ++k) {
    const LocalNode<double>& m = u.nodes[k];
    LocalNode<TimeDual>& n = t.nodes[k];
    lift_values(m, n);
    n.g.setConstant(TimeDual(0.0));
    n.gp.setConstant(TimeDual(0.0));
    const Mat3 dR = cross<double>(m.w) * m.R;
    for (int q = 0; q < 9; ++q) n.R(q).d[0] = dR(q);
    for (int q = 0; q < 3; ++q) n.x(q).d[0] = m.v(q);
  }
  for (int i = 0; i < c.scalar_count; ++i) {
    t.scalar_values[i] = TimeDual(u.scalar_values[i]);
    t.scalar_rates[i] = TimeDual(u.scalar_rates[i]);
  }
  for (int i = 0; i < c.own_count; ++i) {
    t.own_values[i] = TimeDual::variable(u.own_values[i], 0, u.own_rates[i]);
    t.own_rates[i] = TimeDual(u.own_rates[i]);
  }
}

}  // namespace mbcosim::detail
