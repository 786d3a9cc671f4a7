/// Elements: a small struct of parameters with one templated residual, of which a set is made.
///
///     struct SphericalHinge {
///       int first, second;                     // structural node indices
///       Vec3 p, q;                             // in the node frames [m]
///       static constexpr int width = 15;       // local columns: 6 per node + scalar dofs + own
///       static constexpr AssemblyRole assembly = AssemblyRole::holonomic;
///       void connect(Connector& c) { c.node(first); c.node(second); c.algebraic(3); }
///       template <class T> void residual(const Local<T>& u, Residual<T>& r) const {
///         const Vec<T> arm1 = u.R(0) * p, arm2 = u.R(1) * q;  // nodes by order of connection
///         const Vec<T> lambda = u.own3(0);
///         r.load(0, -lambda, -arm1.cross(lambda));  // force [N], moment about the node [N·m]
///         r.load(1, lambda, arm2.cross(lambda));
///         r.own3(0, (u.x(0) + arm1 - u.x(1) - arm2) / u.c());
///       }
///     };
///
/// T is double (residual), Dual<n> (Jacobian) or TimeDual (initial assembly: value and time
/// derivative). Optional members, found by name:
///
///     void tangent(const Local<double>&, Tangent&) const       −∂r/∂δ in closed form
///     void start(Start&) const                                 initial own unknowns and memory
///     void after_predict(const Local<double>&, State&) const   once a step, after the prediction
///     void after_convergence(const Local<double>&, State&) const
///     void output(const Local<double>&, OutputRow&) const      its lines: begin(…, u.label())
///     std::string log(const Model&, int label) const           its line of the .log file
///     int private_datum(std::string_view) const, std::vector<std::string> private_data() const
///     double private_value(const Local<double>&, int) const
///     std::string row_name(int k) const                        meaning of own row k
///     void add_inertia(const Local<double>&, int node, Inertia&) const
///     static constexpr bool momentum_rows = true               has r.momentum(k, …): rows 1–6
///     static constexpr bool rotation_parameters = true         u.g(k), u.gp(k) are gathered
///     static constexpr bool constant_structure = true          entries of its matrix that vanish
///         at one state vanish at all: no branch depends on the state or on a drive
///     void assembly_residual(const Local<T>&, Residual<T>&) const   replaces it in the assembly
///     AssemblyRole assembly_role() const                       when it depends on the element
#pragma once

#include <algorithm>
#include <cstring>
#include <string>
#include <string_view>
#include <vector>

#include "math/dual.h"
#include "math/rotation.h"
#include "math/types.h"
#include "model/context.h"
#include "model/element_set.h"
#include "model/model.h"
#include "model/output_row.h"

namespace mbcosim {

constexpr int kMaxNodes = 4;
constexpr int kMaxScalars = 8;
constexpr int kMaxOwn = 24;
constexpr int kMaxLocal = 6 * kMaxNodes + kMaxScalars + kMaxOwn;

/// Where an element is attached. Local columns and equilibrium rows: 6 (3) per node, 1 per scalar
/// dof, then own unknowns.
struct Connection {
  int node_count = 0, scalar_count = 0, own_count = 0;
  int node[kMaxNodes];      ///< structural node index
  int scalar[kMaxScalars];  ///< scalar node index
  bool own_differential[kMaxOwn] = {};
  int own = -1;     ///< first own unknown
  int memory = -1;  ///< offset in State::memory
  int memory_count = 0;
};

/// Handle of a scalar degree of freedom inside an element: a scalar node, or one component of a
/// connected structural node.
struct LocalDof {
  int scalar = -1;  ///< local scalar index, or
  int node = -1;    ///< local node index and
  int component = 0;
  int order = 0;
};

class Connector {
 public:
  Connector(Connection& c, ModelBuilder& b) : c_(c), builder_(b) {}
  int node(int structural_node) {
    for (int k = 0; k < c_.node_count; ++k)
      if (c_.node[k] == structural_node) return k;
    c_.node[c_.node_count] = structural_node;
    return c_.node_count++;
  }
  /// As `node`, but never merged with an equal one: local index k is the k-th call.
  int distinct_node(int structural_node) {
    c_.node[c_.node_count] = structural_node;
    return c_.node_count++;
  }
  int scalar(int scalar_node) {
    c_.scalar[c_.scalar_count] = scalar_node;
    return c_.scalar_count++;
  }
  LocalDof dof(const NodeDof& d) {
    LocalDof l;
    l.order = d.order;
    l.component = d.component;
    if (d.structural)
      l.node = node(d.node);
    else
      l.scalar = scalar(d.node);
    return l;
  }
  void algebraic(int count) { own(count, false); }
  void differential(int count) { own(count, true); }
  void memory(int count, double initial = 0) {
    const int offset = builder_.allocate_memory(count, initial);
    if (c_.memory < 0) c_.memory = offset;
    c_.memory_count += count;
  }

 private:
  void own(int count, bool differential) {
    for (int i = 0; i < count; ++i) c_.own_differential[c_.own_count++] = differential;
  }
  Connection& c_;
  ModelBuilder& builder_;
};

/// Kinematics of one node in a given scalar type.
template <class T>
struct LocalNode {
  Vec<T> x, v, w;
  Mat<T> R;
  Vec<T> g,
      gp;  ///< rotation parameters of the step and their rates (only with rotation_parameters)
};

/// What an element sees of the state.
template <class T>
class Local {
 public:
  const Vec<T>& x(int k) const { return nodes[k].x; }  ///< position of local node k, global [m]
  const Mat<T>& R(int k) const { return nodes[k].R; }  ///< node frame -> global
  const Vec<T>& v(int k) const { return nodes[k].v; }  ///< velocity, global [m/s]
  const Vec<T>& w(int k) const { return nodes[k].w; }  ///< angular velocity, global [rad/s]
  const Vec<T>& g(int k) const { return nodes[k].g; }
  const Vec<T>& gp(int k) const { return nodes[k].gp; }
  T own(int i) const { return own_values[i]; }      ///< own unknown i
  T own_rate(int i) const { return own_rates[i]; }  ///< its rate (differential unknowns only)
  Vec<T> own3(int i) const { return Vec<T>(own_values[i], own_values[i + 1], own_values[i + 2]); }
  T scalar(int k) const { return scalar_values[k]; }  ///< value of local scalar dof k
  T scalar_rate(int k) const { return scalar_rates[k]; }
  /// Value or rate (by its order) of a degree of freedom. Rotation components have only a rate: the
  /// angular velocity.
  T dof(const LocalDof& d) const {
    if (d.scalar >= 0) return d.order == 0 ? scalar(d.scalar) : scalar_rate(d.scalar);
    if (d.component < 3) return d.order == 0 ? x(d.node)(d.component) : v(d.node)(d.component);
    return w(d.node)(d.component - 3);
  }
  double c() const {
    return context->c;
  }  ///< position constraint rows are divided by it (1 in the assembly)
  double time() const { return context->time; }
  double memory(int i) const { return context->state->memory[connection->memory + i]; }
  int memory_offset() const { return connection->memory; }
  int label() const { return info->label; }
  T drive(const DrivePtr& d) const { return d->value_as<T>(*context); }
  Vec<T> drive(const Vec3DrivePtr& d) const { return d->template value_as<T>(*context); }
  const Model& model() const { return *context->model; }

  const EvalContext* context = nullptr;
  const Connection* connection = nullptr;
  const ElementInfo* info = nullptr;
  LocalNode<T> nodes[kMaxNodes];
  T scalar_values[kMaxScalars], scalar_rates[kMaxScalars];
  T own_values[kMaxOwn], own_rates[kMaxOwn];
};

/// Where an element puts its contributions; everything is added.
template <class T>
class Residual {
 public:
  void force(int k, const Vec<T>& f) {
    for (int i = 0; i < 3; ++i) node[k][i] += f(i);
  }
  void moment(int k, const Vec<T>& m) {
    for (int i = 0; i < 3; ++i) node[k][3 + i] += m(i);
  }
  void load(int k, const Vec<T>& f, const Vec<T>& m) {
    force(k, f);
    moment(k, m);
  }
  /// Rows 1–3 and 4–6 of a dynamic node (momentum definitions).
  void momentum(int k, const Vec<T>& b, const Vec<T>& g) {
    for (int i = 0; i < 3; ++i) {
      momentum_rows[k][i] += b(i);
      momentum_rows[k][3 + i] += g(i);
    }
  }
  void own(int i, const T& value) { own_rows[i] += value; }
  void own3(int i, const Vec<T>& value) {
    for (int k = 0; k < 3; ++k) own_rows[i + k] += value(k);
  }
  void scalar(int k, const T& value) { scalar_rows[k] += value; }
  void dof(const LocalDof& d, const T& value) {
    if (d.scalar >= 0)
      scalar(d.scalar, value);
    else
      node[d.node][d.component] += value;
  }

  T node[kMaxNodes][6];
  T momentum_rows[kMaxNodes][6];
  T scalar_rows[kMaxScalars];
  T own_rows[kMaxOwn];
};

/// Initial values of an element's own unknowns and memory.
struct Start {
  const Local<double>& u;
  State& state;
  double& own(int i) { return state.y[u.connection->own + i]; }
  double& own_rate(int i) { return state.yp[u.connection->own + i]; }
  double& memory(int i) { return state.memory[u.connection->memory + i]; }
};

/// Local matrix −∂r/∂δ of a closed-form linearization. Rows: 6 per node (equilibrium), scalars, own
/// rows, then 6 momentum rows per node; columns: 6 per node (x, g), scalars, own unknowns.
class Tangent {
 public:
  using Block = Eigen::Ref<const Mat3>;
  int row_node(int k) const { return 6 * k; }
  int row_scalar(int k) const { return 6 * nodes + k; }
  int row_own(int i) const { return 6 * nodes + scalars + i; }
  int row_momentum(int k) const { return 6 * nodes + scalars + owns + 6 * k; }
  int col_node(int k) const { return 6 * k; }
  int col_scalar(int k) const { return 6 * nodes + k; }
  int col_own(int i) const { return 6 * nodes + scalars + i; }
  double& at(int row, int column) { return data[column * rows + row]; }
  auto block(int row, int column) {
    return Eigen::Map<Mat3, 0, Eigen::OuterStride<>>(data + column * rows + row, 3, 3,
                                                     Eigen::OuterStride<>(rows));
  }
  /// Adds to rows row..row+2 the dependence on node k: given ∂r/∂x, ∂r/∂v (3×3).
  void add_translation(int row, int k, const Mat3& dx, const Mat3& dv) {
    block(row, col_node(k)) -= c * dx + dv;
  }
  /// The same for ∂r/∂θ, ∂r/∂w (θ: rotation of the node, global components).
  void add_rotation(int row, int k, const Mat3& dtheta, const Mat3& dw) {
    block(row, col_node(k) + 3) -= dtheta * seeds[k].A + dw * seeds[k].B;
  }
  void add_position(int row, int k, const Mat3& dx) { block(row, col_node(k)) -= c * dx; }
  void add_orientation(int row, int k, const Mat3& dtheta) {
    block(row, col_node(k) + 3) -= dtheta * seeds[k].A;
  }

  int nodes = 0, scalars = 0, owns = 0, rows = 0, columns = 0;
  double c = 1;  ///< ∂x/∂δ
  NodeSeeds seeds[kMaxNodes];
  double* data = nullptr;  ///< column-major (rows × columns), zero at entry
};

namespace detail {

template <class E>
concept HasTangent = requires(const E& e, const Local<double>& u, Tangent& t) {
  e.tangent(u, t);
};
template <class E>
concept HasStart = requires(const E& e, Start& s) {
  e.start(s);
};
template <class E>
concept HasAfterPredict = requires(const E& e, const Local<double>& u, State& s) {
  e.after_predict(u, s);
};
template <class E>
concept HasAfterConvergence = requires(const E& e, const Local<double>& u, State& s) {
  e.after_convergence(u, s);
};
template <class E>
concept HasOutput = requires(const E& e, const Local<double>& u, OutputRow& r) {
  e.output(u, r);
};
template <class E>
concept HasLog = requires(const E& e, const Model& m) {
  e.log(m, 0);
};
template <class E>
concept HasPrivateData = requires(const E& e, const Local<double>& u) {
  e.private_datum(std::string_view());
  e.private_value(u, 0);
};
template <class E>
concept HasPrivateNames = requires(const E& e) {
  e.private_data();
};
template <class E>
concept HasRowName = requires(const E& e) {
  e.row_name(0);
};
template <class E>
concept HasInertia = requires(const E& e, const Local<double>& u, Inertia& i) {
  e.add_inertia(u, 0, i);
};
template <class E>
concept HasAssemblyResidual = requires(const E& e, const Local<TimeDual>& u,
                                       Residual<TimeDual>& r) {
  e.assembly_residual(u, r);
};
template <class E>
concept HasAssemblyRole = requires(const E& e) {
  e.assembly_role();
};
template <class E>
concept HasAssembly = requires {
  E::assembly;
};
template <class E>
constexpr bool uses_momentum() {
  if constexpr (requires { E::momentum_rows; })
    return E::momentum_rows;
  else
    return false;
}
template <class E>
constexpr bool uses_parameters() {
  if constexpr (requires { E::rotation_parameters; })
    return E::rotation_parameters;
  else
    return false;
}
template <class E>
constexpr bool has_constant_structure() {
  if constexpr (requires { E::constant_structure; })
    return E::constant_structure;
  else
    return false;
}
/// Dual numbers come in a few widths, so that element types share instantiations.
constexpr int dual_width(int columns) {
  return columns <= 6 ? 6 : columns <= 12 ? 12 : columns <= 18 ? 18 : 24;
}

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
  struct Slot {
    E element;
    ElementInfo info;
    Connection connection;
    int first_row = 0, row_count = 0;        ///< in rows_
    int first_column = 0, column_count = 0;  ///< in columns_
    int first_entry = 0, entry_count = 0;    ///< in entries_
  };

  void add(ModelBuilder& builder, ElementInfo info, E element) {
    Slot s{std::move(element), std::move(info), {}, 0, 0, 0, 0, 0, 0};
    Connector connector(s.connection, builder);
    s.element.connect(connector);
    slots_.push_back(std::move(s));
  }
  const E& element(int i) const { return slots_[i].element; }

  int size() const override { return static_cast<int>(slots_.size()); }
  const ElementInfo& info(int i) const override { return slots_[i].info; }
  ElementInfo& info(int i) override { return slots_[i].info; }
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
          if (vanishes.empty() || !vanishes[local]) entries_.push_back({local, -1});
        }
      s.entry_count = static_cast<int>(entries_.size()) - s.first_entry;
    }
  }
  void collect_pattern(PatternSink& sink) const override {
    for_each_entry(entries_, [&](const Entry&, int row, int column) { sink.entry(row, column); });
  }
  void set_positions(const PositionSource& source) override {
    for_each_entry(entries_, [&](Entry& e, int row, int column) {
      e.position = source.position(row, column);
    });
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

  void residual(const EvalContext& context, double* r) const override {
    Local<double> u;
    Residual<double> local;
    for (const Slot& s : slots_) {
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

  void jacobian(const EvalContext& context, const NodeSeeds* seeds, double* values) const override {
    Local<double> u;
    double matrix[kMatrix];
    for (const Slot& s : slots_) {
      if (s.row_count == 0 || s.column_count == 0) continue;
      local_jacobian(context, s, seeds, u, matrix);
      const Entry* entry = &entries_[s.first_entry];
      for (int k = 0; k < s.entry_count; ++k) values[entry[k].position] += matrix[entry[k].local];
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
  /// The same by duals, for tests and for types
  /// without a closed form.
  void dual_jacobian(const Slot& s, const Local<double>& u, const NodeSeeds* seeds,
                     double* matrix) const {
    constexpr int width = detail::dual_width(E::width);
    using D = Dual<width>;
    Local<D> lu;
    Residual<D> lr;
    for (int start = 0; start < s.column_count; start += width) {
      lift(s, u, seeds, start, lu);
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
    detail::gather(context, s.connection, s.info, detail::uses_parameters<E>(), u);
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
      return slots_[i].element.log(model, slots_[i].info.label);
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
      if (!active(context, slots_[i])) return 0;
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
  /// One entry of a local matrix that may differ from zero, and its place among the sparse values.
  struct Entry {
    int local, position;
  };
  template <class Entries, class Function>
  void for_each_entry(Entries& entries, Function function) const {
    for (const Slot& s : slots_)
      for (int k = s.first_entry; k < s.first_entry + s.entry_count; ++k)
        function(entries[k], rows_[s.first_row + entries[k].local % s.row_count],
                 columns_[s.first_column + entries[k].local / s.row_count]);
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

  bool active(const EvalContext& context, const Slot& s) const {
    return s.info.active_memory < 0 || context.state->memory[s.info.active_memory] != 0;
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
    const int* row = &rows_[s.first_row];
    for (int k = 0; k < s.row_count; ++k)
      if (row[k] >= 0) r[row[k]] += flat[k];
  }
  void inactive_jacobian(const EvalContext& context, const Slot& s, double* matrix) const {
    const Connection& c = s.connection;
    const int base = 6 * c.node_count + c.scalar_count;
    for (int i = 0; i < c.own_count; ++i)
      matrix[(base + i) * s.row_count + base + i] = c.own_differential[i] ? context.seed : 1.0;
  }
  /// Values with derivatives with respect to local columns start .. start+width−1.
  template <class D>
  void lift(const Slot& s, const Local<double>& u, const NodeSeeds* seeds, int start,
            Local<D>& l) const {
    const Connection& c = s.connection;
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
      n.x = m.x.template cast<D>();
      n.v = m.v.template cast<D>();
      n.w = m.w.template cast<D>();
      n.R = m.R.template cast<D>();
      if constexpr (detail::uses_parameters<E>()) {
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
          if constexpr (detail::uses_parameters<E>()) {
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
    t.context = u.context;
    t.connection = u.connection;
    t.info = u.info;
    for (int k = 0; k < c.node_count; ++k) {
      const LocalNode<double>& m = u.nodes[k];
      LocalNode<TimeDual>& n = t.nodes[k];
      n.x = m.x.template cast<TimeDual>();
      n.v = m.v.template cast<TimeDual>();
      n.w = m.w.template cast<TimeDual>();
      n.R = m.R.template cast<TimeDual>();
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
  std::vector<int> rows_, columns_;
  std::vector<Entry> entries_;
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
  const int* column = &columns_[s.first_column];
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
