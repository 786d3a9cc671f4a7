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

/// Columns of a panel between two looks at X: they stay in registers.
#ifdef __AVX512F__
constexpr int kDeep = 8;
#else
constexpr int kDeep = 4;
#endif

/// U := L⁻¹ U for the unit lower triangle that starts at `panel` (Width × Width).
template <int Columns, int Width>
inline void solve_triangle(const double* panel, std::ptrdiff_t stride, double* u) {
  Numbers<Columns> of[Width];
  for (int q = 0; q < Width; ++q) of[q] = Eigen::Map<const Numbers<Columns>>(u + q * Columns);
  for (int q = 0; q < Width; ++q)
    for (int p = q + 1; p < Width; ++p) of[p] -= panel[q * stride + p] * of[q];
  for (int q = 1; q < Width; ++q) Eigen::Map<Numbers<Columns>>(u + q * Columns) = of[q];
}

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

/// The first Width columns of the panel; of its own rows those after these columns.
template <int Columns, int Width>
inline void eliminate(const Panel& panel, double* x) {
  double* const u = x + std::ptrdiff_t{panel.first} * Columns;
  solve_triangle<Columns, Width>(panel.numbers, panel.stride, u);
  const int own = panel.width - Width + panel.own;
  const double* const after = panel.numbers + Width;
  subtract_product<Columns, Width>(after, panel.stride, own, u, u + std::ptrdiff_t{Width} * Columns,
                                   [](int i) { return std::ptrdiff_t{i} * Columns; });
  subtract_product<Columns, Width>(
      after + own, panel.stride, panel.below, u, x,
      [rows = panel.rows](int i) { return std::ptrdiff_t{rows[i]} * Columns; });
}

template <int Columns>
inline void eliminate(const Panel& whole, double* x) {
  Panel panel = whole;
  const auto take = [&]<int Width>() {
    eliminate<Columns, Width>(panel, x);
    panel.numbers += Width * (panel.stride + 1);
    panel.first += Width;
    panel.width -= Width;
  };
  while (panel.width >= kDeep) take.template operator()<kDeep>();
  if constexpr (kDeep > 4)
    if (panel.width >= 4) take.template operator()<4>();
  if (panel.width == 3) take.template operator()<3>();
  if (panel.width == 2) take.template operator()<2>();
  if (panel.width == 1) take.template operator()<1>();
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
inline void clear(const int* rows, int count, double* x) {
  for (int i = 0; i < count; ++i)
    Eigen::Map<Numbers<Columns>>(x + std::ptrdiff_t{rows[i]} * Columns) = Numbers<Columns>::Zero();
}

/// With the next products; returns those after them.
template <int Count, bool Divides>
inline const NumberProduct* take_update(const NumberUpdate& update, const NumberProduct* product,
                                        const double* f, double* x) {
  constexpr int kWide = Count < NumberUpdate::kBlock ? Count : NumberUpdate::kBlock;
  constexpr int kBlocks = Count / kWide;
  using Block = Numbers<kWide>;
  Block of[kBlocks];
  double* const to = x + update.target;
  for (int b = 0; b < kBlocks; ++b) of[b] = Eigen::Map<const Block>(to + b * kWide);
  for (const NumberProduct* const end = product + update.products; product != end; ++product) {
    const double* const from = f + product->factor;
    const double other = x[product->other];
    for (int b = 0; b < kBlocks; ++b) of[b] -= Eigen::Map<const Block>(from + b * kWide) * other;
  }
  if constexpr (Divides)
    for (int b = 0; b < kBlocks; ++b) of[b] /= f[update.pivot];
  for (int b = 0; b < kBlocks; ++b) Eigen::Map<Block>(to + b * kWide) = of[b];
  return product;
}

/// With the next products of blocks; returns those after them.
template <bool Divides>
inline const NumberProduct* take_dots(const NumberUpdate& update, const NumberProduct* product,
                                      const double* f, double* x) {
  constexpr int kBlock = NumberUpdate::kBlock;
  using Block = Numbers<kBlock>;
  double of = x[update.target];
  for (const NumberProduct* const end = product + update.products; product != end; ++product) {
    const Block products =
        Eigen::Map<const Block>(f + product->factor) * Eigen::Map<const Block>(x + product->other);
    for (int i = kBlock; i-- > 0;) of -= products[i];
  }
  if constexpr (Divides) of /= f[update.pivot];
  x[update.target] = of;
  return product;
}

inline const NumberProduct* update(const NumberUpdate* updates, std::size_t count,
                                   const NumberProduct* product, const double* f, double* x) {
  constexpr int kBlock = NumberUpdate::kBlock;
  const auto take = [&]<int Count>(const NumberUpdate& each) {
    product = each.divides ? take_update<Count, true>(each, product, f, x)
                           : take_update<Count, false>(each, product, f, x);
  };
  for (const NumberUpdate* const end = updates + count; updates != end; ++updates) {
    if (updates->dots)
      product = updates->divides ? take_dots<true>(*updates, product, f, x)
                                 : take_dots<false>(*updates, product, f, x);
    else if (updates->count == 1)
      take.template operator()<1>(*updates);
    else if (updates->count == kBlock)
      take.template operator()<kBlock>(*updates);
    else if (updates->count == 2 * kBlock)
      take.template operator()<2 * kBlock>(*updates);
    else
      take.template operator()<3 * kBlock>(*updates);
  }
  return product;
}

template <int Columns>
constexpr PanelKernels kernels() {
  return {Columns, eliminate<Columns>, finish<Columns>, clear<Columns>};
}

}  // namespace

}  // namespace mbcosim
