/// All elements of one type: their place in the model, gathering, assembly and results.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <deque>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "elements/element_traits.h"
#include "elements/element_view.h"
#include "elements/lift.h"

namespace mbcosim {

namespace detail {

void gather(const EvalContext& context, const Connection& c, const ElementInfo& info,
            bool parameters, Local<double>& u);
std::string default_row_name(int k);
/// rows: 6/node, scalars, own [, momentum 6/node]; columns: 6/node, scalars, own. -1 where there is
/// none.
void fill_rows_columns(const Model& model, const Connection& c, bool momentum,
                       std::vector<int>& rows, std::vector<int>& columns);

}  // namespace detail

template <class E>
class ElementSetOf final : public ElementSet {
 public:
  /// What evaluations read, close together in memory.
  struct Slot {
    E element;
    Connection connection{};
    const ElementInfo* info = nullptr;
    int activity = -1;                       ///< flag of a `driven` element in State::memory
    int first_row = 0, row_count = 0;        ///< in rows_
    int first_column = 0, column_count = 0;  ///< in columns_
    int first_entry = 0, entry_count = 0;    ///< in entries_
    int first_run = 0, run_count = 0;        ///< in runs_
  };

  void add(ModelBuilder& builder, ElementInfo info, E element) {
    infos_.push_back(std::move(info));
    Slot s{.element = std::move(element), .info = &infos_.back()};
    Connector connector(s.connection, builder);
    s.element.connect(connector);
    slots_.push_back(std::move(s));
  }
  const E& element(int i) const { return slots_[i].element; }

  int size() const override { return static_cast<int>(slots_.size()); }
  const ElementInfo& info(int i) const override { return infos_[i]; }
  ElementInfo& info(int i) override { return infos_[i]; }
  int unknowns(int i) const override { return slots_[i].connection.own_count; }
  bool is_differential(int i, int k) const override {
    return slots_[i].connection.own_differential[k];
  }
  std::string row_name(int i, int k) const override {
    if constexpr (detail::HasRowName<E>)
      return slots_[i].element.row_name(k);
    else
      return detail::default_row_name(k);
  }
  std::vector<int> nodes(int i) const override {
    const Connection& c = slots_[i].connection;
    return std::vector<int>(c.node, c.node + c.node_count);
  }
  int first_own(int i) const override { return slots_[i].connection.own; }

  void bind(const Model& model, int i, int first_own) override {
    Slot& s = slots_[i];
    s.connection.own = first_own;
    s.activity = s.info->active_memory;
    std::vector<int> rows, columns;
    detail::fill_rows_columns(model, s.connection, detail::uses_momentum<E>(), rows, columns);
    s.first_row = static_cast<int>(rows_.size());
    s.row_count = static_cast<int>(rows.size());
    s.first_column = static_cast<int>(columns_.size());
    s.column_count = static_cast<int>(columns.size());
    rows_.insert(rows_.end(), rows.begin(), rows.end());
    columns_.insert(columns_.end(), columns.begin(), columns.end());
  }
  void find_structure(const std::vector<StructureProbe>& probes) override {
    entries_.clear();
    for (Slot& s : slots_) {
      s.first_entry = static_cast<int>(entries_.size());
      std::vector<bool> vanishes;
      if constexpr (detail::has_constant_structure<E>())
        if (!probes.empty()) vanishes = vanishing(s, probes);
      for (int j = 0; j < s.column_count; ++j)
        for (int i = 0; i < s.row_count; ++i) {
          const int local = j * s.row_count + i;
          if (rows_[s.first_row + i] < 0 || columns_[s.first_column + j] < 0) continue;
          if (vanishes.empty() || !vanishes[local]) entries_.push_back(local);
        }
      s.entry_count = static_cast<int>(entries_.size()) - s.first_entry;
    }
  }
  void collect_pattern(PatternSink& sink) const override {
    for (const Slot& s : slots_)
      for_each_entry(s, [&](int, int row, int column) { sink.entry(row, column); });
  }
  /// Entries that follow each other in the local matrix and among the sparse values become one run.
  void set_positions(const PositionSource& source) override {
    runs_.clear();
    for (Slot& s : slots_) {
      s.first_run = static_cast<int>(runs_.size());
      for_each_entry(s, [&](int local, int row, int column) {
        const int position = source.position(row, column);
        const bool follows = static_cast<int>(runs_.size()) > s.first_run &&
                             runs_.back().local + runs_.back().count == local &&
                             runs_.back().position + runs_.back().count == position;
        if (follows)
          ++runs_.back().count;
        else
          runs_.push_back({position, static_cast<std::uint16_t>(local), 1});
      });
      s.run_count = static_cast<int>(runs_.size()) - s.first_run;
    }
    runs_.shrink_to_fit();
    entries_ = {};
  }

  void start(const EvalContext& context, State& state, int i) const override {
    if constexpr (detail::HasStart<E>) {
      Local<double> u;
      gather(context, slots_[i], u);
      Start st{u, state};
      slots_[i].element.start(st);
    } else {
      (void)context, (void)state, (void)i;
    }
  }

  void residual(const EvalContext& context, double* r, ElementRange range) const override {
    Local<double> u;
    Residual<double> local;
    for (int k = range.first; k < range.last; ++k) {
      const Slot& s = slots_[k];
      if (!active(context, s)) {
        const Connection& c = s.connection;
        for (int i = 0; i < c.own_count; ++i) r[c.own + i] -= context.state->y[c.own + i];
        continue;
      }
      gather(context, s, u);
      clear(local, s.connection);
      s.element.residual(u, local);
      scatter(s, local, r);
    }
  }

  void jacobian(const EvalContext& context, const NodeSeeds* seeds, double* values,
                ElementRange range) const override {
    Local<double> u;
    double matrix[kMatrix];
    for (int i = range.first; i < range.last; ++i) {
      const Slot& s = slots_[i];
      if (s.row_count == 0 || s.column_count == 0) continue;
      local_jacobian(context, s, seeds, u, matrix);
      const Run* const first = runs_.data() + s.first_run;
      for (const Run* run = first; run != first + s.run_count; ++run)
        for (int k = 0; k < run->count; ++k) values[run->position + k] += matrix[run->local + k];
    }
  }

  /// Local matrix (row_count × column_count, column-major); `u` is scratch.
  void local_jacobian(const EvalContext& context, const Slot& s, const NodeSeeds* seeds,
                      Local<double>& u, double* matrix) const {
    std::memset(matrix, 0, sizeof(double) * s.row_count * s.column_count);
    if (!active(context, s)) return inactive_jacobian(context, s, matrix);
    gather(context, s, u);
    if constexpr (detail::HasTangent<E>)
      closed_form(context, s, u, seeds, matrix);
    else
      dual_jacobian(s, u, seeds, matrix);
  }
  /// The same by duals, for tests and for types without a closed form.
  void dual_jacobian(const Slot& s, const Local<double>& u, const NodeSeeds* seeds,
                     double* matrix) const {
    constexpr int width = detail::dual_width(E::width);
    using D = Dual<width>;
    Local<D> lu;
    Residual<D> lr;
    for (int start = 0; start < s.column_count; start += width) {
      detail::lift<detail::uses_parameters<E>()>(u, seeds, start, lu);
      clear(lr, s.connection);
      s.element.residual(lu, lr);
      const int last = std::min(width, s.column_count - start);
      for (int j = 0; j < last; ++j) {
        double* column = matrix + (start + j) * s.row_count;
        store(
            s, column, [&](const D& x) { return -x.d[j]; }, lr);
      }
    }
  }
  void closed_form(const EvalContext& context, const Slot& s, const Local<double>& u,
                   const NodeSeeds* seeds, double* matrix) const requires detail::HasTangent<E> {
    Tangent t;
    t.nodes = s.connection.node_count;
    t.scalars = s.connection.scalar_count;
    t.owns = s.connection.own_count;
    t.rows = s.row_count;
    t.columns = s.column_count;
    t.c = context.seed;
    for (int k = 0; k < t.nodes; ++k) t.seeds[k] = seeds[s.connection.node[k]];
    t.data = matrix;
    s.element.tangent(u, t);
  }
  const Slot& slot(int i) const { return slots_[i]; }
  Slot& slot(int i) { return slots_[i]; }  ///< while the model is built
  void gather(const EvalContext& context, const Slot& s, Local<double>& u) const {
    detail::gather(context, s.connection, *s.info, detail::uses_parameters<E>(), u);
  }

  void after_predict(const EvalContext& context, State& state) const override {
    if constexpr (detail::HasAfterPredict<E>) {
      Local<double> u;
      for (const Slot& s : slots_) {
        if (!active(context, s)) continue;
        gather(context, s, u);
        s.element.after_predict(u, state);
      }
    } else {
      (void)context, (void)state;
    }
  }
  void after_convergence(const EvalContext& context, State& state) const override {
    if constexpr (detail::HasAfterConvergence<E>) {
      Local<double> u;
      for (const Slot& s : slots_) {
        if (!active(context, s)) continue;
        gather(context, s, u);
        s.element.after_convergence(u, state);
      }
    } else {
      (void)context, (void)state;
    }
  }

  AssemblyRole assembly_role(int i) const override {
    if constexpr (detail::HasAssemblyRole<E>)
      return slots_[i].element.assembly_role();
    else if constexpr (detail::HasAssembly<E>)
      return E::assembly;
    else
      return AssemblyRole::none;
  }
  void assembly_residual(const EvalContext& context, int i, double* r,
                         double* r_rate) const override {
    const Slot& s = slots_[i];
    Local<double> u;
    gather(context, s, u);
    double local[2 * kMaxLocal + 12 * kMaxNodes] = {};
    assembly_local(s, u, local, local + s.row_count);
    for (int k = 0; k < s.row_count; ++k) {
      const int row = rows_[s.first_row + k];
      if (row < 0) continue;
      r[row] += local[k];
      r_rate[row] += local[s.row_count + k];
    }
  }
  void assembly_jacobian(const EvalContext& context, int i, int n,
                         std::vector<Triplet>& out) const override;

  void output(const EvalContext& context, int i, OutputRow& row) const override {
    if constexpr (detail::HasOutput<E>) {
      Local<double> u;
      gather(context, slots_[i], u);
      slots_[i].element.output(u, row);
    } else {
      (void)context, (void)i, (void)row;
    }
  }
  std::string log_line(const Model& model, int i) const override {
    if constexpr (detail::HasLog<E>)
      return slots_[i].element.log(model, infos_[i].label);
    else
      return (void)model, (void)i, std::string();
  }
  int private_datum(int i, std::string_view name) const override {
    if constexpr (detail::HasPrivateData<E>)
      return slots_[i].element.private_datum(name);
    else
      return (void)i, (void)name, -1;
  }
  std::vector<std::string> private_data(int i) const override {
    if constexpr (detail::HasPrivateNames<E>)
      return slots_[i].element.private_data();
    else
      return (void)i, std::vector<std::string>();
  }
  double private_value(const EvalContext& context, int i, int datum) const override {
    if constexpr (detail::HasPrivateData<E>) {
      if (!is_active(*context.state, i)) return 0;
      Local<double> u;
      gather(context, slots_[i], u);
      return slots_[i].element.private_value(u, datum);
    } else {
      return (void)context, (void)i, (void)datum, 0;
    }
  }
  void add_inertia(const EvalContext& context, int i, int node, Inertia& inertia) const override {
    if constexpr (detail::HasInertia<E>) {
      Local<double> u;
      gather(context, slots_[i], u);
      slots_[i].element.add_inertia(u, node, inertia);
    } else {
      (void)context, (void)i, (void)node, (void)inertia;
    }
  }
  void add_momentum(const EvalContext& context, int i, State& state) const override {
    if constexpr (detail::uses_momentum<E>()) {
      Local<double> u;
      Residual<double> local;
      gather(context, slots_[i], u);
      clear(local, slots_[i].connection);
      slots_[i].element.residual(u, local);
      const Connection& c = slots_[i].connection;
      for (int k = 0; k < c.node_count; ++k) {
        const StructuralNode& node = context.model->structural[c.node[k]];
        if (!node.has_momentum()) continue;
        const int np = node.position_unknowns();
        for (int j = 0; j < np; ++j) state.y[node.first + np + j] -= local.momentum_rows[k][j];
      }
    } else {
      (void)context, (void)i, (void)state;
    }
  }

 private:
  /// Consecutive entries of a local matrix and their places among the sparse values.
  struct Run {
    int position;
    std::uint16_t local, count;
  };
  /// Calls with local index, row and column of each entry that may differ from zero.
  template <class Function>
  void for_each_entry(const Slot& s, Function function) const {
    for (int k = s.first_entry; k < s.first_entry + s.entry_count; ++k)
      function(entries_[k], rows_[s.first_row + entries_[k] % s.row_count],
               columns_[s.first_column + entries_[k] / s.row_count]);
  }
  /// Entries of the local matrix that vanish at all probes, other than those of an inactive
  /// element. Empty: a drive of the element has no value there, nothing is known.
  std::vector<bool> vanishing(const Slot& s, const std::vector<StructureProbe>& probes) const {
    const int size = s.row_count * s.column_count;
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
        inactive_jacobian(probe.context, s, matrix);
        keep();
        local_jacobian(probe.context, s, probe.seeds.data(), u, matrix);
        keep();
      }
    } catch (const EvaluationError&) {
      vanishes.clear();
    }
    return vanishes;
  }
  static constexpr int kMatrix = (kMaxLocal + 6 * kMaxNodes) * kMaxLocal;
  static_assert(kMatrix <= std::numeric_limits<std::uint16_t>::max());

  bool active(const EvalContext& context, const Slot& s) const {
    return s.activity < 0 || context.state->memory[s.activity] != 0;
  }
  template <class T>
  static void clear(Residual<T>& r, const Connection& c) {
    for (int k = 0; k < c.node_count; ++k)
      for (int i = 0; i < 6; ++i) {
        r.node[k][i] = T(0.0);
        if constexpr (detail::uses_momentum<E>()) r.momentum_rows[k][i] = T(0.0);
      }
    for (int i = 0; i < c.scalar_count; ++i) r.scalar_rows[i] = T(0.0);
    for (int i = 0; i < c.own_count; ++i) r.own_rows[i] = T(0.0);
  }
  /// Writes local rows in order through `get`.
  template <class T, class Get>
  static void store(const Slot& s, double* out, Get get, const Residual<T>& r) {
    const Connection& c = s.connection;
    for (int k = 0; k < c.node_count; ++k)
      for (int i = 0; i < 6; ++i) *out++ = get(r.node[k][i]);
    for (int i = 0; i < c.scalar_count; ++i) *out++ = get(r.scalar_rows[i]);
    for (int i = 0; i < c.own_count; ++i) *out++ = get(r.own_rows[i]);
    if constexpr (detail::uses_momentum<E>())
      for (int k = 0; k < c.node_count; ++k)
        for (int i = 0; i < 6; ++i) *out++ = get(r.momentum_rows[k][i]);
  }
  void scatter(const Slot& s, const Residual<double>& local, double* r) const {
    double flat[kMaxLocal + 6 * kMaxNodes];
    store(
        s, flat, [](double x) { return x; }, local);
    const int* row = rows_.data() + s.first_row;
    for (int k = 0; k < s.row_count; ++k)
      if (row[k] >= 0) r[row[k]] += flat[k];
  }
  void inactive_jacobian(const EvalContext& context, const Slot& s, double* matrix) const {
    const Connection& c = s.connection;
    const int base = 6 * c.node_count + c.scalar_count;
    for (int i = 0; i < c.own_count; ++i)
      matrix[(base + i) * s.row_count + base + i] = c.own_differential[i] ? context.seed : 1.0;
  }
  /// Local rows and their time derivatives in the initial assembly.
  void assembly_local(const Slot& s, const Local<double>& u, double* rows, double* rates) const {
    const Connection& c = s.connection;
    const AssemblyRole role = [&] {
      if constexpr (detail::HasAssemblyRole<E>)
        return s.element.assembly_role();
      else if constexpr (detail::HasAssembly<E>)
        return E::assembly;
      else
        return AssemblyRole::none;
    }();
    if (role == AssemblyRole::elastic) {
      Residual<double> r;
      clear(r, c);
      s.element.residual(u, r);
      store(
          s, rows, [](double x) { return x; }, r);
      return;
    }
    Local<TimeDual> t;
    detail::lift_in_time(u, t);
    Residual<TimeDual> r;
    clear(r, c);
    if constexpr (detail::HasAssemblyResidual<E>)
      s.element.assembly_residual(t, r);
    else
      s.element.residual(t, r);
    store(
        s, rows, [](const TimeDual& x) { return x.v; }, r);
    store(
        s, rates, [](const TimeDual& x) { return x.d[0]; }, r);
  }

  std::vector<Slot> slots_;
  std::deque<ElementInfo> infos_;
  std::vector<int> rows_, columns_;
  std::vector<int> entries_;  ///< local indices; until the positions are known
  std::vector<Run> runs_;
};

/// Central differences on local values: the assembly is done once, and Newton needs no more than
/// these.
template <class E>
void ElementSetOf<E>::assembly_jacobian(const EvalContext& context, int i, int n,
                                        std::vector<Triplet>& out) const {
  const Slot& s = slots_[i];
  const Connection& c = s.connection;
  Local<double> base;
  gather(context, s, base);
  constexpr int kRows = 2 * (kMaxLocal + 6 * kMaxNodes);
  double plus[kRows], minus[kRows];
  const int rows = s.row_count;
  const auto differentiate = [&](int column, double step, auto&& change) {
    if (column < 0) return;
    std::memset(plus, 0, sizeof plus);
    std::memset(minus, 0, sizeof minus);
    Local<double> u = base;
    change(u, step);
    assembly_local(s, u, plus, plus + rows);
    u = base;
    change(u, -step);
    assembly_local(s, u, minus, minus + rows);
    for (int k = 0; k < 2 * rows; ++k) {
      const int row = rows_[s.first_row + k % rows];
      const double d = (plus[k] - minus[k]) / (2 * step);
      if (row >= 0 && d != 0) out.push_back({row + (k >= rows ? n : 0), column, -d});
    }
  };
  constexpr double kStep = 1e-6;
  const int* column = columns_.data() + s.first_column;
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

/// Adds an element of any type to the model being built.
template <class E>
ElementRef add_element(ModelBuilder& builder, ElementInfo info, E element) {
  auto& set = builder.set<ElementSetOf<E>>();
  set.add(builder, std::move(info), std::move(element));
  return builder.register_element(set);
}

}  // namespace mbcosim
