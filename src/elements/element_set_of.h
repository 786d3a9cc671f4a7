/// All elements of one type: their place in the model, gathering, assembly and results.
#pragma once

#include <algorithm>
#include <cstring>
#include <string>
#include <string_view>
#include <vector>

#include "elements/element_traits.h"
#include "elements/element_view.h"
#include "elements/lift.h"
#include "elements/placed_elements.h"

namespace mbcosim {

template <class E>
class ElementSetOf final : public PlacedElements {
 public:
  /// What evaluations read, close together in memory.
  struct Slot : Place {
    E element;
  };

  ElementSetOf()
      : PlacedElements({.parameters = detail::uses_parameters<E>(),
                        .momentum = detail::uses_momentum<E>(),
                        .constant_structure = detail::has_constant_structure<E>()}) {}
  void add(ModelBuilder& builder, ElementInfo info, E element) {
    Slot s{{.info = keep(std::move(info))}, std::move(element)};
    Connector connector(s.connection, builder);
    s.element.connect(connector);
    slots_.push_back(std::move(s));
  }
  const E& element(int i) const { return slots_[i].element; }

  int size() const override { return static_cast<int>(slots_.size()); }
  std::string row_name(int i, int k) const override {
    if constexpr (detail::HasRowName<E>)
      return slots_[i].element.row_name(k);
    else
      return PlacedElements::row_name(i, k);
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
        inactive_residual(context, s, r);
        continue;
      }
      residual_of(context, s, u, local);
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
      local_matrix(context, i, seeds, u, matrix);
      add_matrix(s, matrix, values);
    }
  }

  void local_matrix(const EvalContext& context, int i, const NodeSeeds* seeds, Local<double>& u,
                    double* matrix) const override {
    const Slot& s = slots_[i];
    std::memset(matrix, 0, sizeof(double) * s.row_count * s.column_count);
    if (!active(context, s)) return inactive_matrix(context, s, matrix);
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
    constexpr bool parameters = detail::uses_parameters<E>(), momentum = detail::uses_momentum<E>();
    Local<Dual<width>> lu;
    Residual<Dual<width>> lr;
    for (int start = 0; start < s.column_count; start += width) {
      detail::lift(u, seeds, start, parameters, lu);
      detail::clear(lr, s.connection, momentum);
      s.element.residual(lu, lr);
      detail::store_columns(lr, s.connection, momentum, std::min(width, s.column_count - start),
                            s.row_count, matrix + start * s.row_count);
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

  void at_derivatives(const EvalContext& context, State& state, ElementRange range,
                      bool first) const override {
    if constexpr (detail::HasAtDerivatives<E>)
      each_active(context, range,
                  [&](const E& e, const Local<double>& u) { e.at_derivatives(u, state, first); });
    else
      (void)context, (void)state, (void)range, (void)first;
  }
  void after_predict(const EvalContext& context, State& state, ElementRange range) const override {
    if constexpr (detail::HasAfterPredict<E>)
      each_active(context, range,
                  [&](const E& e, const Local<double>& u) { e.after_predict(u, state); });
    else
      (void)context, (void)state, (void)range;
  }
  bool accumulates() const override { return detail::HasAccumulate<E>; }
  void accumulate(const EvalContext& context, ElementRange range) const override {
    if constexpr (detail::HasAccumulate<E>) {
      Sums sums(*context.scratch);
      each_active(context, range,
                  [&](const E& e, const Local<double>& u) { e.accumulate(u, sums); });
    } else {
      (void)context, (void)range;
    }
  }
  void after_convergence(const EvalContext& context, State& state,
                         ElementRange range) const override {
    if constexpr (detail::HasAfterConvergence<E>)
      each_active(context, range,
                  [&](const E& e, const Local<double>& u) { e.after_convergence(u, state); });
    else
      (void)context, (void)state, (void)range;
  }

  AssemblyRole assembly_role(int i) const override {
    if constexpr (detail::HasAssemblyRole<E>)
      return slots_[i].element.assembly_role();
    else if constexpr (detail::HasAssembly<E>)
      return E::assembly;
    else
      return AssemblyRole::none;
  }

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
      return slots_[i].element.log(model, info(i).label);
    else
      return (void)model, (void)i, std::string();
  }
  int private_datum(int i, std::string_view name) const override {
    if constexpr (detail::HasPrivateData<E>)
      return slots_[i].element.private_datum(name);
    else
      return (void)i, (void)name, -1;
  }
  std::vector<Datum> private_data(int i) const override {
    if constexpr (detail::HasPrivateNames<E>)
      return slots_[i].element.private_data();
    else
      return (void)i, std::vector<Datum>();
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
      residual_of(context, slots_[i], u, local);
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

 protected:
  const PlacedElements::Place& place(int i) const override { return slots_[i]; }
  PlacedElements::Place& place(int i) override { return slots_[i]; }
  void assembly_rows(int i, const Local<double>& u, double* rows, double* rates) const override {
    if constexpr (detail::HasAssemblyRole<E>) {
      if (assembly_role(i) == AssemblyRole::elastic)
        elastic_rows(slots_[i], u, rows);
      else
        differentiated_rows(slots_[i], u, rows, rates);
    } else if constexpr (!detail::HasAssembly<E>) {
      (void)i, (void)u, (void)rows, (void)rates;  // takes no part
    } else if constexpr (E::assembly == AssemblyRole::elastic) {
      elastic_rows(slots_[i], u, rows), (void)rates;
    } else {
      differentiated_rows(slots_[i], u, rows, rates);
    }
  }

 private:
  /// Calls function(element, what it sees) for the active ones.
  template <class Function>
  void each_active(const EvalContext& context, ElementRange range, Function function) const {
    Local<double> u;
    for (int i = range.first; i < range.last; ++i) {
      const Slot& s = slots_[i];
      if (!active(context, s)) continue;
      gather(context, s, u);
      function(s.element, u);
    }
  }
  void residual_of(const EvalContext& context, const Slot& s, Local<double>& u,
                   Residual<double>& local) const {
    gather(context, s, u);
    detail::clear(local, s.connection, detail::uses_momentum<E>());
    s.element.residual(u, local);
  }
  void elastic_rows(const Slot& s, const Local<double>& u, double* rows) const {
    constexpr bool momentum = detail::uses_momentum<E>();
    Residual<double> r;
    detail::clear(r, s.connection, momentum);
    s.element.residual(u, r);
    detail::store_rows(r, s.connection, momentum, rows);
  }
  void differentiated_rows(const Slot& s, const Local<double>& u, double* rows,
                           double* rates) const {
    constexpr bool momentum = detail::uses_momentum<E>();
    Local<TimeDual> t;
    detail::lift_in_time(u, t);
    Residual<TimeDual> r;
    detail::clear(r, s.connection, momentum);
    if constexpr (detail::HasAssemblyResidual<E>)
      s.element.assembly_residual(t, r);
    else
      s.element.residual(t, r);
    detail::store_rows(r, s.connection, momentum, rows, rates);
  }

  std::vector<Slot> slots_;
};

/// Adds an element of any type to the model being built.
template <class E>
ElementRef add_element(ModelBuilder& builder, ElementInfo info, E element) {
  auto& set = builder.set<ElementSetOf<E>>();
  set.add(builder, std::move(info), std::move(element));
  return builder.register_element(set);
}

}  // namespace mbcosim
