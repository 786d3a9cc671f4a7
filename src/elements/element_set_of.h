/// All elements of one type: their place in the model, gathering, assembly and results.
#pragma once

#include <algorithm>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <variant>
#include <vector>

#include "elements/element_traits.h"
#include "elements/element_view.h"
#include "elements/lift.h"
#include "elements/movable_part.h"
#include "elements/placed_elements.h"
#include "model/drive.h"

namespace mbcosim {

template <class E>
class ElementSetOf final : public PlacedElements {
  static constexpr bool kMovable = detail::HasMovableParts<E>;
  template <class T>
  using IfMovable = std::conditional_t<kMovable, T, std::monostate>;

 public:
  /// A part that a hint moves; its numbers from `memory` on in State::memory.
  struct Moved {
    MovablePart<E> part;
    int memory;
  };
  /// What evaluations read, close together in memory.
  struct Slot : Place {
    E element;
    [[no_unique_address]] IfMovable<std::vector<Moved>> moved{};
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
  /// As the deck has it.
  const E& element(int i) const { return slots_[i].element; }
  bool add_hint(ModelBuilder& builder, int i, std::string_view hint) override {
    if constexpr (kMovable) {
      for (const MovablePart<E>& part : E::template movable_parts<E>())
        if (part.hint == hint) return move_part(builder, i, part), true;
    }
    return PlacedElements::add_hint(builder, i, hint);
  }

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
      Present(context, slots_[i])->start(st);
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
      if (!detail::follows_drives<E>() || s.connection.followed.empty())
        return closed_form(context, s, u, seeds, matrix);
    if constexpr (!detail::HasTangent<E> || detail::follows_drives<E>())
      dual_jacobian(s, u, seeds, matrix);
  }
  /// The same by duals, for tests and for types without a closed form.
  void dual_jacobian(const Slot& s, const Local<double>& u, const NodeSeeds* seeds,
                     double* matrix) const {
    constexpr int width = detail::dual_width(E::width);
    constexpr bool parameters = detail::uses_parameters<E>(), momentum = detail::uses_momentum<E>();
    Local<Dual<width>> lu;
    Residual<Dual<width>> lr;
    const Present element(*u.context, s);
    for (int start = 0; start < s.column_count; start += width) {
      detail::lift(u, seeds, start, parameters, lu);
      detail::clear(lr, s.connection, momentum);
      element->residual(lu, lr);
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
    Present(context, s)->tangent(u, t);
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
  bool stages_apart(int i) const override {
    if constexpr (detail::HasStagesApart<E>)
      return slots_[i].element.stages_apart();
    else
      return (void)i, false;
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

  bool constrains_velocity(int i, int k) const override {
    if constexpr (detail::ConstrainsVelocity<E>)
      return slots_[i].element.constrains_velocity(k);
    else
      return PlacedElements::constrains_velocity(i, k);
  }

  void output(const EvalContext& context, int i, OutputRow& row) const override {
    if constexpr (detail::HasOutput<E>) {
      Local<double> u;
      gather(context, slots_[i], u);
      Present(context, slots_[i])->output(u, row);
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
      return Present(context, slots_[i])->private_value(u, datum);
    } else {
      return (void)context, (void)i, (void)datum, 0;
    }
  }
  void add_inertia(const EvalContext& context, int i, int node, Inertia& inertia) const override {
    if constexpr (detail::HasInertia<E>) {
      Local<double> u;
      gather(context, slots_[i], u);
      Present(context, slots_[i])->add_inertia(u, node, inertia);
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
  /// The element as it is now: that of its slot, or a copy in which hints have moved parts.
  class Present {
   public:
    Present(const EvalContext& context, const Slot& s) : element_(&s.element) {
      if constexpr (kMovable) {
        if (s.moved.empty()) return;
        E& moved = copy_.emplace(s.element);
        for (const Moved& m : s.moved)
          std::copy_n(&context.state->memory[m.memory], m.part.count, m.part.numbers(moved));
        element_ = &moved;
      }
    }
    Present(const Present&) = delete;
    const E* operator->() const { return element_; }
    const E& operator*() const { return *element_; }

   private:
    const E* element_;
    [[no_unique_address]] IfMovable<std::optional<E>> copy_;
  };
  /// Number k of a part as it fits where the nodes are.
  class FittedNumber final : public Drive {
   public:
    FittedNumber(const ElementSetOf& set, int i, const MovablePart<E>& part, int k)
        : set_(set), i_(i), part_(part), k_(k) {}
    double value(const EvalContext& context, double) const override {
      const Slot& s = set_.slots_[i_];
      Local<double> u;
      set_.gather(context, s, u);
      E element = *Present(context, s);
      part_.fit(element, u);
      return part_.numbers(element)[k_];
    }

   private:
    const ElementSetOf& set_;
    int i_;
    MovablePart<E> part_;
    int k_;
  };
  void move_part(ModelBuilder& builder, int i, const MovablePart<E>& part) {
    for (int k = 0; k < part.count; ++k) {
      const int memory = builder.allocate_memory(1, part.numbers(slots_[i].element)[k]);
      if (k == 0) slots_[i].moved.push_back({part, memory});
      info(i).hints.push_back(
          {std::make_shared<FittedNumber>(*this, i, part, k), memory, /*at_start=*/false});
    }
  }
  /// Calls function(element, what it sees) for the active ones.
  template <class Function>
  void each_active(const EvalContext& context, ElementRange range, Function function) const {
    Local<double> u;
    for (int i = range.first; i < range.last; ++i) {
      const Slot& s = slots_[i];
      if (!active(context, s)) continue;
      gather(context, s, u);
      function(*Present(context, s), u);
    }
  }
  void residual_of(const EvalContext& context, const Slot& s, Local<double>& u,
                   Residual<double>& local) const {
    gather(context, s, u);
    detail::clear(local, s.connection, detail::uses_momentum<E>());
    Present(context, s)->residual(u, local);
  }
  void elastic_rows(const Slot& s, const Local<double>& u, double* rows) const {
    constexpr bool momentum = detail::uses_momentum<E>();
    Residual<double> r;
    detail::clear(r, s.connection, momentum);
    Present(*u.context, s)->residual(u, r);
    detail::store_rows(r, s.connection, momentum, rows);
  }
  void differentiated_rows(const Slot& s, const Local<double>& u, double* rows,
                           double* rates) const {
    constexpr bool momentum = detail::uses_momentum<E>();
    Local<TimeDual> t;
    detail::lift_in_time(u, t);
    Residual<TimeDual> r;
    detail::clear(r, s.connection, momentum);
    const Present element(*u.context, s);
    if constexpr (detail::HasAssemblyResidual<E>)
      element->assembly_residual(t, r);
    else
      element->residual(t, r);
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
