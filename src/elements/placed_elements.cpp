#include "elements/placed_elements.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <utility>

namespace mbcosim {

namespace {

/// Rows: 6 per node, scalars, own [, momentum 6 per node]; columns: 6 per node, scalars, own. −1
/// where there is none.
void append_rows_columns(const Model& model, const Connection& c, bool momentum,
                         std::vector<int>& rows, std::vector<int>& columns) {
  for (int k = 0; k < c.node_count; ++k) {
    const StructuralNode& node = model.structural[c.node[k]];
    const int count = node.position_unknowns();
    for (int i = 0; i < 6; ++i) {
      const bool has_row = i < count && k < c.node_count - c.seen_nodes;
      rows.push_back(has_row ? node.equilibrium + i : -1);
      columns.push_back(i < count ? node.first + i : -1);
    }
  }
  for (int i = 0; i < c.scalar_count; ++i) {
    const int unknown = model.scalars[c.scalar[i]].unknown;
    rows.push_back(i < c.scalar_count - c.seen_scalars ? unknown : -1);
    columns.push_back(unknown);
  }
  for (int i = 0; i < c.own_count; ++i) {
    rows.push_back(c.own + i);
    columns.push_back(c.own + i);
  }
  if (!momentum) return;
  for (int k = 0; k < c.node_count; ++k) {
    const StructuralNode& node = model.structural[c.node[k]];
    const int count = node.has_momentum() ? node.position_unknowns() : 0;
    for (int i = 0; i < 6; ++i) rows.push_back(i < count ? node.first + i : -1);
  }
}

}  // namespace

std::string PlacedElements::row_name(int, int k) const {
  return "equation " + std::to_string(k + 1);
}

std::vector<int> PlacedElements::nodes(int i) const {
  const Connection& c = place(i).connection;
  return std::vector<int>(c.node, c.node + c.node_count - c.seen_nodes);
}

const ElementInfo* PlacedElements::keep(ElementInfo info) {
  infos_.push_back(std::move(info));
  return &infos_.back();
}

// ------------------------------------------------------------------ structure

void PlacedElements::bind(const Model& model, int i, int first_own) {
  Place& p = place(i);
  p.connection.own = first_own;
  find_followed(model, p.connection);
  p.activity = p.info->active_memory;
  p.first_row = static_cast<int>(rows_.size());
  p.first_column = static_cast<int>(columns_.size());
  append_rows_columns(model, p.connection, traits_.momentum, rows_, columns_);
  p.row_count = static_cast<int>(rows_.size()) - p.first_row;
  p.column_count = static_cast<int>(columns_.size()) - p.first_column;
}

void PlacedElements::find_structure(const std::vector<StructureProbe>& probes) {
  entries_.clear();
  for (int e = 0; e < size(); ++e) {
    Place& p = place(e);
    p.first_entry = static_cast<int>(entries_.size());
    std::vector<bool> vanishes;
    const bool constant =
        traits_.constant_structure && info(e).hints.empty() && p.connection.followed.empty();
    if (constant && !probes.empty()) vanishes = vanishing(e, probes);
    for (int j = 0; j < p.column_count; ++j)
      for (int i = 0; i < p.row_count; ++i) {
        const int local = j * p.row_count + i;
        if (rows_[p.first_row + i] < 0 || columns_[p.first_column + j] < 0) continue;
        if (vanishes.empty() || !vanishes[local]) entries_.push_back(local);
      }
    p.entry_count = static_cast<int>(entries_.size()) - p.first_entry;
  }
}

void PlacedElements::append_rows(const Model&, int i, std::vector<int>& rows) const {
  const Place& p = place(i);
  rows.insert(rows.end(), rows_.begin() + p.first_row, rows_.begin() + p.first_row + p.row_count);
}

/// Entries of the local matrix that vanish at all probes, other than those of an inactive element.
/// Empty: a drive of the element has no value there, nothing is known.
std::vector<bool> PlacedElements::vanishing(int i,
                                            const std::vector<StructureProbe>& probes) const {
  const Place& p = place(i);
  const int size = p.row_count * p.column_count;
  std::vector<bool> vanishes(size, true);
  Local<double> u;
  double matrix[kMatrix];
  const auto keep = [&] {
    for (int k = 0; k < size; ++k)
      if (matrix[k] != 0) vanishes[k] = false;
  };
  try {
    for (const StructureProbe& probe : probes) {
      std::memset(matrix, 0, sizeof(double) * size);
      inactive_matrix(probe.context, p, matrix);
      keep();
      local_matrix(probe.context, i, probe.seeds.data(), u, matrix);
      keep();
    }
  } catch (const EvaluationError&) {
    vanishes.clear();
  }
  return vanishes;
}

/// Calls with local index, row and column of each entry that may differ from zero.
template <class Function>
void PlacedElements::for_each_entry(const Place& p, Function function) const {
  for (int k = p.first_entry; k < p.first_entry + p.entry_count; ++k)
    function(entries_[k], rows_[p.first_row + entries_[k] % p.row_count],
             columns_[p.first_column + entries_[k] / p.row_count]);
}

void PlacedElements::collect_pattern(PatternSink& sink) const {
  for (int i = 0; i < size(); ++i)
    for_each_entry(place(i), [&](int, int row, int column) { sink.entry(row, column); });
}

void PlacedElements::set_positions(const PositionSource& source) {
  runs_.clear();
  for (int i = 0; i < size(); ++i) {
    Place& p = place(i);
    p.first_run = static_cast<int>(runs_.size());
    for_each_entry(p, [&](int local, int row, int column) {
      const int position = source.position(row, column);
      const bool follows = static_cast<int>(runs_.size()) > p.first_run &&
                           runs_.back().local + runs_.back().count == local &&
                           runs_.back().position + runs_.back().count == position;
      if (follows)
        ++runs_.back().count;
      else
        runs_.push_back({position, static_cast<std::uint16_t>(local), 1});
    });
    p.run_count = static_cast<int>(runs_.size()) - p.first_run;
  }
  runs_.shrink_to_fit();
  entries_ = {};
}

// ------------------------------------------------------------------ elements that are not active

void PlacedElements::inactive_residual(const EvalContext& context, const Place& p,
                                       double* r) const {
  const Connection& c = p.connection;
  for (int i = 0; i < c.own_count; ++i) r[c.own + i] -= context.state->y[c.own + i];
}

void PlacedElements::inactive_matrix(const EvalContext& context, const Place& p,
                                     double* matrix) const {
  const Connection& c = p.connection;
  const int base = 6 * c.node_count + c.scalar_count;
  for (int i = 0; i < c.own_count; ++i)
    matrix[(base + i) * p.row_count + base + i] = c.own_differential[i] ? context.seed : 1.0;
}

// ------------------------------------------------------------------ initial assembly

void PlacedElements::assembly_residual(const EvalContext& context, int i, double* r,
                                       double* r_rate) const {
  const Place& p = place(i);
  Local<double> u;
  gather(context, p, u);
  double rows[kRows] = {}, rates[kRows] = {};
  assembly_rows(i, u, rows, rates);
  for (int k = 0; k < p.row_count; ++k) {
    const int row = rows_[p.first_row + k];
    if (row < 0) continue;
    r[row] += rows[k];
    r_rate[row] += rates[k];
  }
}

void PlacedElements::assembly_jacobian(const EvalContext& context, int i, int n,
                                       std::vector<Triplet>& out) const {
  const Place& p = place(i);
  const Connection& c = p.connection;
  Local<double> base;
  gather(context, p, base);
  double plus[2 * kRows], minus[2 * kRows];
  const int rows = p.row_count;
  const auto differentiate = [&](int column, double step, auto&& change) {
    if (column < 0) return;
    std::memset(plus, 0, sizeof plus);
    std::memset(minus, 0, sizeof minus);
    Local<double> u = base;
    change(u, step);
    assembly_rows(i, u, plus, plus + rows);
    u = base;
    change(u, -step);
    assembly_rows(i, u, minus, minus + rows);
    for (int k = 0; k < 2 * rows; ++k) {
      const int row = rows_[p.first_row + k % rows];
      const double d = (plus[k] - minus[k]) / (2 * step);
      if (row >= 0 && d != 0) out.push_back({row + (k >= rows ? n : 0), column, -d});
    }
  };
  constexpr double kStep = 1e-6;
  const int* column = columns_.data() + p.first_column;
  const auto level = [&](int q, bool rate) {
    return column[q] < 0 ? -1 : column[q] + (rate ? n : 0);
  };
  for (int k = 0; k < c.node_count; ++k)
    for (int q = 0; q < 3; ++q) {
      differentiate(level(6 * k + q, false), kStep,
                    [&](Local<double>& u, double e) { u.nodes[k].x(q) += e; });
      differentiate(level(6 * k + q, true), kStep,
                    [&](Local<double>& u, double e) { u.nodes[k].v(q) += e; });
      differentiate(level(6 * k + 3 + q, false), kStep, [&](Local<double>& u, double e) {
        u.nodes[k].R = rotation_of_vector<double>(Vec3::Unit(q) * e) * u.nodes[k].R;
      });
      differentiate(level(6 * k + 3 + q, true), kStep,
                    [&](Local<double>& u, double e) { u.nodes[k].w(q) += e; });
    }
  const int o0 = 6 * c.node_count + c.scalar_count;
  for (int q = 0; q < c.own_count; ++q) {
    const double scale = kStep * std::max(1.0, std::abs(base.own_values[q]));
    differentiate(level(o0 + q, false), scale,
                  [&](Local<double>& u, double e) { u.own_values[q] += e; });
    differentiate(level(o0 + q, true), kStep * std::max(1.0, std::abs(base.own_rates[q])),
                  [&](Local<double>& u, double e) { u.own_rates[q] += e; });
  }
}

}  // namespace mbcosim
