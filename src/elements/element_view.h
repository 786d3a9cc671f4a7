/// What an element sees of the state (`Local`) and where it puts its contributions (`Residual`,
/// `Tangent`), with the unknowns it is attached to (`Connection`).
#pragma once

#include "math/dual.h"
#include "math/rotation.h"
#include "math/types.h"
#include "model/check.h"
#include "model/context.h"
#include "model/drive.h"
#include "model/element_set.h"
#include "model/model.h"
#include "model/output_row.h"

namespace mbcosim {

constexpr int kMaxNodes = 4;
constexpr int kMaxScalars = 8;
constexpr int kMaxOwn = 24;
constexpr int kMaxLocal = 6 * kMaxNodes + kMaxScalars + kMaxOwn;

/// Handle of a scalar degree of freedom inside an element: a scalar node, or one component of a
/// connected structural node.
struct LocalDof {
  int scalar = -1;  ///< local scalar index, or
  int node = -1;    ///< local node index and
  int component = 0;
  int order = 0;
};

/// What a drive of an element follows at once, in the order of its slopes; without node and scalar
/// where the matrix leaves it out.
struct FollowedDofs {
  const StateFollower* drive;
  std::vector<LocalDof> dofs;
};

/// Where an element is attached. Local columns and equilibrium rows: 6 (3) per node, 1 per scalar
/// dof, then own unknowns.
struct Connection {
  int node_count = 0, scalar_count = 0, own_count = 0;
  int seen_nodes = 0, seen_scalars = 0;  ///< the last ones, which only drives see: without rows
  int node[kMaxNodes];                   ///< structural node index
  int scalar[kMaxScalars];               ///< scalar node index
  bool own_differential[kMaxOwn] = {};
  int own = -1;     ///< first own unknown
  int memory = -1;  ///< offset in State::memory
  int memory_count = 0;
  int scratch_count = 0;  ///< doubles that it needs in Scratch::local
  int sums = -1;          ///< offset in Scratch::sums
  int sum_count = 0;
  std::vector<FollowedDofs> followed;  ///< their dofs are found when the model is complete
};

/// Finds what drives follow and gives their nodes and scalar nodes local numbers, as far as there
/// is room.
void find_followed(const Model& model, Connection& connection);

class Connector {
 public:
  Connector(Connection& c, ModelBuilder& b) : c_(c), builder_(b) {}
  int node(int structural_node) {
    for (int k = 0; k < c_.node_count; ++k)
      if (c_.node[k] == structural_node) return k;
    return distinct_node(structural_node);
  }
  /// As `node`, but never merged with an equal one: local index k is the k-th call.
  int distinct_node(int structural_node) {
    MBCOSIM_CHECK(c_.node_count < kMaxNodes, "an element has more nodes than there is room for");
    c_.node[c_.node_count] = structural_node;
    return c_.node_count++;
  }
  int scalar(int scalar_node) {
    MBCOSIM_CHECK(c_.scalar_count < kMaxScalars,
                  "an element has more scalar dofs than there is room for");
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
  /// What drives follow at once shall be in the matrix of Newton's method (Local::drive).
  template <class... DriveP>
  void drives(const DriveP&... drives) {
    (c_.followed.push_back({drives.get(), {}}), ...);
  }
  void algebraic(int count) { own(count, false); }
  void differential(int count) { own(count, true); }
  void memory(int count, double initial = 0) {
    const int offset = builder_.allocate_memory(count, initial);
    if (c_.memory < 0) c_.memory = offset;
    MBCOSIM_CHECK(offset == c_.memory + c_.memory_count, "an element's memory is not in one piece");
    c_.memory_count += count;
  }
  /// Numbers that `Local::scratch` gives while the element is evaluated.
  void scratch(int count) {
    c_.scratch_count += count;
    builder_.require_scratch(c_.scratch_count);
  }
  /// Numbers that elements of other families add to before the element reads them: Local::sum.
  void sums(int count) {
    const int offset = builder_.allocate_sums(count);
    if (c_.sums < 0) c_.sums = offset;
    MBCOSIM_CHECK(offset == c_.sums + c_.sum_count, "an element's sums are not in one piece");
    c_.sum_count += count;
  }

 private:
  void own(int count, bool differential) {
    MBCOSIM_CHECK(c_.own_count + count <= kMaxOwn,
                  "an element has more unknowns than there is room for");
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
  /// Derivative of scalar(k) by its unknown of the step: c, or 1 where it has no rate.
  double scalar_seed(int k) const {
    return model().scalars[connection->scalar[k]].differential ? context->seed : 1;
  }
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
  /// As many numbers as the element asked for in `connect`; what they hold at entry means nothing.
  double* scratch() const {
    MBCOSIM_CHECK(context->scratch, "scratch is used where there is none");
    return context->scratch->local.data();
  }
  /// What other elements have summed up for this one in the present evaluation.
  double sum(int i) const { return sum_at(connection->sums + i); }
  int sums_offset() const { return connection->sums; }
  /// The same of another element, by its `ElementSet::first_sum`.
  double sum_at(int offset) const {
    MBCOSIM_CHECK(context->scratch && offset >= 0, "sums are read where there are none");
    return context->scratch->sums[offset];
  }
  int label() const { return info->label; }
  T drive(const DrivePtr& d) const {
    T r = d->value_as<T>(*context);
    if constexpr (kByIncrements)
      if (const FollowedDofs* followed = followed_by(d.get())) {
        std::array<double, kMaxFollowed> slopes;
        double* next = slopes.data();
        d->write_slopes(*context, 1, next);
        for (std::size_t k = 0; k < followed->dofs.size(); ++k)
          follow(followed->dofs[k], slopes[k], r);
      }
    return r;
  }
  Vec<T> drive(const Vec3DrivePtr& d) const {
    Vec<T> r = d->template value_as<T>(*context);
    if constexpr (kByIncrements)
      if (const FollowedDofs* followed = followed_by(d.get())) {
        std::array<Vec3, kMaxFollowed> slopes;
        Vec3* next = slopes.data();
        d->write_slopes(*context, next);
        for (std::size_t k = 0; k < followed->dofs.size(); ++k)
          for (int i = 0; i < 3; ++i) follow(followed->dofs[k], slopes[k](i), r(i));
      }
    return r;
  }
  const Model& model() const { return *context->model; }

  const EvalContext* context = nullptr;
  const Connection* connection = nullptr;
  const ElementInfo* info = nullptr;
  LocalNode<T> nodes[kMaxNodes];
  T scalar_values[kMaxScalars], scalar_rates[kMaxScalars];
  T own_values[kMaxOwn], own_rates[kMaxOwn];

 private:
  static constexpr bool kByIncrements = !std::is_same_v<T, double> && !std::is_same_v<T, TimeDual>;
  const FollowedDofs* followed_by(const StateFollower* drive) const {
    if (!context->follows) return nullptr;
    for (const FollowedDofs& each : connection->followed)
      if (each.drive == drive) return &each;
    return nullptr;
  }
  void follow(const LocalDof& d, double slope, T& value) const {
    if ((d.scalar < 0 && d.node < 0) || !std::isfinite(slope)) return;
    const T x = dof(d);
    for (int j = 0; j < T::directions; ++j) value.d[j] += slope * x.d[j];
  }
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

/// What elements sum over others, open for contributions; offsets as in ElementSet::first_sum.
class Sums {
 public:
  explicit Sums(Scratch& scratch) : sums_(scratch.sums) {}
  double& operator[](int offset) {
    MBCOSIM_CHECK(offset >= 0 && offset < static_cast<int>(sums_.size()),
                  "a sum of no element is added to");
    return sums_[offset];
  }

 private:
  std::vector<double>& sums_;
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
  void add_velocity(int row, int k, const Mat3& dv) { block(row, col_node(k)) -= dv; }
  void add_position(int row, int k, const Mat3& dx) { block(row, col_node(k)) -= c * dx; }
  void add_orientation(int row, int k, const Mat3& dtheta) {
    block(row, col_node(k) + 3) -= dtheta * seeds[k].A;
  }
  /// Adds to one row its dependence on the rotation and the angular velocity of node k: ∂r/∂θ,
  /// ∂r/∂w.
  void add_to_row(int row, int k, const Vec3& dtheta, const Vec3& dw = Vec3::Zero()) {
    const Eigen::RowVector3d entries =
        dtheta.transpose() * seeds[k].A + dw.transpose() * seeds[k].B;
    for (int j = 0; j < 3; ++j) at(row, col_node(k) + 3 + j) -= entries(j);
  }
  /// The same for its position and velocity: ∂r/∂x, ∂r/∂v.
  void add_point_to_row(int row, int k, const Vec3& dx, const Vec3& dv = Vec3::Zero()) {
    for (int j = 0; j < 3; ++j) at(row, col_node(k) + j) -= c * dx(j) + dv(j);
  }
  /// Adds to three rows from `row` the derivative with respect to the unknown of one column.
  void add_to_column(int row, int column, const Vec3& derivative) {
    for (int j = 0; j < 3; ++j) at(row + j, column) -= derivative(j);
  }

  int nodes = 0, scalars = 0, owns = 0, rows = 0, columns = 0;
  double c = 1;  ///< ∂x/∂δ
  NodeSeeds seeds[kMaxNodes];
  double* data = nullptr;  ///< column-major (rows × columns), zero at entry
};

}  // namespace mbcosim
