/// The same view of a state in numbers that carry derivatives: by Newton increments (`Dual`) or by
/// time (`TimeDual`), and what becomes of the rows written in them.
#pragma once

#include "elements/element_view.h"

namespace mbcosim::detail {

/// Dual numbers come in a few widths, so that element types share instantiations (lift.cpp).
constexpr int dual_width(int columns) {
  return columns <= 6 ? 6 : columns <= 12 ? 12 : columns <= 18 ? 18 : 24;
}

/// Values with derivatives with respect to the local columns start .. start + D::directions − 1;
/// `parameters`: g and ġ, too.
template <class D>
void lift(const Local<double>& u, const NodeSeeds* seeds, int start, bool parameters, Local<D>& l);

/// Positions, orientations and own unknowns with their rates.
void lift_in_time(const Local<double>& u, Local<TimeDual>& t);

/// Sets to zero what an element with this connection adds to.
template <class T>
void clear(Residual<T>& r, const Connection& c, bool momentum);

/// The rows in order: nodes, scalars, own, momentum.
void store_rows(const Residual<double>& r, const Connection& c, bool momentum, double* rows);
void store_rows(const Residual<TimeDual>& r, const Connection& c, bool momentum, double* rows,
                double* rates);
/// Their derivatives with a minus, a column for each of the first `columns` directions, to
/// `matrix` (row_count × columns, column-major).
template <class D>
void store_columns(const Residual<D>& r, const Connection& c, bool momentum, int columns,
                   int row_count, double* matrix);

}  // namespace mbcosim::detail
