#include "elements/lift.h"

#include <algorithm>

namespace mbcosim::detail {

namespace {

template <class T>
void lift_values(const LocalNode<double>& from, LocalNode<T>& to) {
  to.x = from.x.template cast<T>();
  to.v = from.v.template cast<T>();
  to.w = from.w.template cast<T>();
  to.R = from.R.template cast<T>();
}

/// Calls `put` with each row in order.
template <class T, class Put>
void for_each_row(const Residual<T>& r, const Connection& c, bool momentum, Put put) {
  for (int k = 0; k < c.node_count; ++k)
    for (int i = 0; i < 6; ++i) put(r.node[k][i]);
  for (int i = 0; i < c.scalar_count; ++i) put(r.scalar_rows[i]);
  for (int i = 0; i < c.own_count; ++i) put(r.own_rows[i]);
  if (!momentum) return;
  for (int k = 0; k < c.node_count; ++k)
    for (int i = 0; i < 6; ++i) put(r.momentum_rows[k][i]);
}

/// Column `column` of local node k (3 + i: rotation component i) becomes direction j.
template <class D>
void seed_node(const LocalNode<double>& m, const NodeSeeds& seed, double c, bool parameters,
               int column, int j, LocalNode<D>& n) {
  if (column < 3) {
    n.x(column).d[j] = c;
    n.v(column).d[j] = 1;
    return;
  }
  const int i = column - 3;
  const Mat3 dR = cross<double>(seed.A.col(i)) * m.R;
  for (int q = 0; q < 9; ++q) n.R(q).d[j] = dR(q);
  for (int q = 0; q < 3; ++q) n.w(q).d[j] = seed.B(q, i);
  if (!parameters) return;
  n.g(i).d[j] = c;
  n.gp(i).d[j] = 1;
}

}  // namespace

template <class D>
void lift(const Local<double>& u, const NodeSeeds* seeds, int start, bool parameters, Local<D>& l) {
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
    if (parameters) {
      n.g = m.g.template cast<D>();
      n.gp = m.gp.template cast<D>();
    }
    for (int i = 0; i < 6; ++i)
      if (const int j = slot_of(6 * k + i); j >= 0)
        seed_node(m, seeds[c.node[k]], cc, parameters, i, j, n);
  }
  const int s0 = 6 * c.node_count;
  for (int i = 0; i < c.scalar_count; ++i) {
    l.scalar_values[i] = D(u.scalar_values[i]);
    l.scalar_rates[i] = D(u.scalar_rates[i]);
    if (const int j = slot_of(s0 + i); j >= 0) {
      const bool differential = u.context->model->scalars[c.scalar[i]].differential;
      l.scalar_values[i].d[j] = u.scalar_seed(i);
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

void lift_in_time(const Local<double>& u, Local<TimeDual>& t) {
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

template <class T>
void clear(Residual<T>& r, const Connection& c, bool momentum) {
  std::fill_n(r.node[0], 6 * c.node_count, T(0.0));
  if (momentum) std::fill_n(r.momentum_rows[0], 6 * c.node_count, T(0.0));
  std::fill_n(r.scalar_rows, c.scalar_count, T(0.0));
  std::fill_n(r.own_rows, c.own_count, T(0.0));
}

void store_rows(const Residual<double>& r, const Connection& c, bool momentum, double* rows) {
  for_each_row(r, c, momentum, [&](double x) { *rows++ = x; });
}

void store_rows(const Residual<TimeDual>& r, const Connection& c, bool momentum, double* rows,
                double* rates) {
  for_each_row(r, c, momentum, [&](const TimeDual& x) {
    *rows++ = x.v;
    *rates++ = x.d[0];
  });
}

template <class D>
void store_columns(const Residual<D>& r, const Connection& c, bool momentum, int columns,
                   int row_count, double* matrix) {
  for_each_row(r, c, momentum, [&](const D& x) {
    for (int j = 0; j < columns; ++j) matrix[j * row_count] = -x.d[j];
    ++matrix;
  });
}

template void clear(Residual<double>&, const Connection&, bool);
template void clear(Residual<TimeDual>&, const Connection&, bool);

#define MBCOSIM_INSTANTIATE(D)                                                      \
  template void lift(const Local<double>&, const NodeSeeds*, int, bool, Local<D>&); \
  template void clear(Residual<D>&, const Connection&, bool);                       \
  template void store_columns(const Residual<D>&, const Connection&, bool, int, int, double*);
MBCOSIM_INSTANTIATE(Dual<6>)
MBCOSIM_INSTANTIATE(Dual<12>)
MBCOSIM_INSTANTIATE(Dual<18>)
MBCOSIM_INSTANTIATE(Dual<24>)
#undef MBCOSIM_INSTANTIATE

}  // namespace mbcosim::detail
