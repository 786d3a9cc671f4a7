/// One version of the kernels: included once by each file that is compiled for a processor, which
/// renames Eigen's namespace so that the linker cannot mix versions of its functions. Nothing else
/// that is a template may be used here.
#pragma once

#include <Eigen/Core>

#include "solver/panel_kernels.h"

namespace mbcosim {

namespace {

template <int Columns>
using Numbers = Eigen::Array<double, Columns, 1>;

/// X[row(i)] −= Σ_q panel(i, q) U[q] for count rows: each number of the panel is read once for all
/// columns.
template <int Columns, int Width, class Row>
inline void subtract_product(const double* panel, std::ptrdiff_t stride, int count, const double* u,
                             double* x, Row row) {
  Numbers<Columns> of[Width];
  for (int q = 0; q < Width; ++q) of[q] = Eigen::Map<const Numbers<Columns>>(u + q * Columns);
  for (int i = 0; i < count; ++i) {
    Eigen::Map<Numbers<Columns>> to(x + row(i));
    Numbers<Columns> a = to;
    for (int q = 0; q < Width; ++q) a -= panel[q * stride + i] * of[q];
    to = a;
  }
}

template <int Columns, class Row>
inline void subtract_product(const double* panel, std::ptrdiff_t stride, int count, const double* u,
                             int width, double* x, Row row) {
  for (; width >= 4; width -= 4, panel += 4 * stride, u += 4 * Columns)
    subtract_product<Columns, 4>(panel, stride, count, u, x, row);
  if (width == 3) subtract_product<Columns, 3>(panel, stride, count, u, x, row);
  if (width == 2) subtract_product<Columns, 2>(panel, stride, count, u, x, row);
  if (width == 1) subtract_product<Columns, 1>(panel, stride, count, u, x, row);
}

/// U := L⁻¹ U for the unit lower triangle that starts at `panel` (width × width).
template <int Columns>
inline void solve_triangle(const double* panel, std::ptrdiff_t stride, double* u, int width) {
  for (int q = 0; q + 1 < width; ++q, panel += stride + 1, u += Columns) {
    const Numbers<Columns> of = Eigen::Map<const Numbers<Columns>>(u);
    for (int p = 1; p < width - q; ++p)
      Eigen::Map<Numbers<Columns>>(u + p * Columns) -= panel[p] * of;
  }
}

template <int Columns>
inline void eliminate(const Panel& panel, double* x) {
  double* const u = x + std::ptrdiff_t{panel.first} * Columns;
  if (panel.width > 1) solve_triangle<Columns>(panel.numbers, panel.stride, u, panel.width);
  const double* below = panel.numbers + panel.width;
  if (panel.own > 0)
    subtract_product<Columns>(below, panel.stride, panel.own, u, panel.width,
                              u + std::ptrdiff_t{panel.width} * Columns,
                              [](int i) { return std::ptrdiff_t{i} * Columns; });
  below += panel.own;
  subtract_product<Columns>(
      below, panel.stride, panel.below, u, panel.width, x,
      [rows = panel.rows](int i) { return std::ptrdiff_t{rows[i]} * Columns; });
}

template <int Columns>
inline void finish(const Panel& panel, double* column, int place, double pivot, const double* u,
                   double* x) {
  const Numbers<Columns> of = Eigen::Map<const Numbers<Columns>>(u);
  const auto take = [&](double* row) {
    const double factor = *column++ = row[place] / pivot;
    Eigen::Map<Numbers<Columns>>(row) -= factor * of;
  };
  for (int i = 1; i <= panel.own; ++i) take(x + std::ptrdiff_t{panel.first + i} * Columns);
  for (int i = 0; i < panel.below; ++i) take(x + std::ptrdiff_t{panel.rows[i]} * Columns);
}

template <int Columns>
constexpr PanelKernels kernels() {
  return {Columns, eliminate<Columns>, finish<Columns>};
}

}  // namespace

}  // namespace mbcosim
