/// Modal joint: a flexible body as a floating frame plus a combination of shapes, clamped to
/// ordinary nodes.
///
/// Floating frame at x, R (a modal node with velocities v, w as unknowns, or fixed), amplitudes q,
/// velocities p (M each). With ω = Rᵀw and, in floating axes, S = S0 + Inv3 q, J = J0 + A8 + A8ᵀ −
/// A9, B = Inv4 + A5 (sums over amplitudes: A5 = Σ q_j Inv5_jk, A8 = Σ q_j Inv8_j, A9 = ΣΣ q_j q_k
/// Inv9_jk; a p marks the same sum with p in place of q), the rows are
///
///   1–3    v − ẋ = 0                       4–6   w − w(g, ġ) = 0
///   force  −R [ m v̇ − S × ẇ + ω × (ω × S) + Inv3 ṗ + 2 ω × Inv3 p ] + m γ − Σ F_k = 0
///   moment −R [ S × v̇ + J ẇ + ω × J ω + B ṗ + 2 (A8p − A9p) ω + (A10p + A10pᵀ) ω
///             + R (ω × Inv11 p) ] + S × γ
///          − Σ (d_k × F_k + R_k μ_k) = 0     (v̇, ẇ in floating axes inside the brackets)
///   q      p − q̇ = 0
///   mode j −(Mgen ṗ + C p + Kgen q)_j − Inv3_j·(v̇ − γ) − B_j·ẇ − 2 A5p_j·ω
///          + ωᵀ (Inv8_jᵀ − Σ q_k Inv9_jk + Inv10_j) ω − Σ (U_kjᵀ Rᵀ F_k + V_kjᵀ Rᵀ R_k μ_k) = 0
///   node k (x_k + R_k o_k − x − d_k)/c = 0,   −vec(R_kᵀ R (1 + (V_k q)×))/c = 0
///          with d_k = R (f_k + U_k q)
///
/// F [N] is the force on the interface node in global axes, μ [N·m] the couple on it in the node's
/// axes, γ the gravity acceleration. N.B. the factor R before (ω × Inv11 p) is what MBDyn does;
/// `consistent_rotary_coupling` leaves it out. Source: MBDyn input manual and technical manual,
/// modal joint.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "elements/modal/modal_body.h"
#include "model/element_set.h"
#include "model/model.h"

namespace mbcosim {

/// A multibody node clamped to a FEM node.
struct ModalInterface {
  int node = -1;          ///< structural node
  int fem_node = -1;      ///< index in the body
  Vec3 f = Vec3::Zero();  ///< position of the FEM node in the floating frame [m]
  MatX U, V;              ///< its displacement and rotation shapes (3 × M)
  Vec3 o = Vec3::Zero();  ///< from the node to the FEM node, in the node's frame [m]
  bool output = false;
};

struct ModalJoint {
  int node = -1;               ///< modal node, -1: clamped
  Vec3 x0 = Vec3::Zero();      ///< clamped: position of the floating frame [m]
  Mat3 R0 = Mat3::Identity();  ///< clamped: its orientation
  std::shared_ptr<const ModalBody> body;
  std::vector<ModalInterface> interfaces;
  VecX initial_q, initial_p;  ///< (M)
  bool consistent_rotary_coupling = false;
};

/// Kinematics of the floating frame; suffix _l: floating axes.
struct FloatingFrame {
  Vec3 x, v, w, vp, wp;       ///< v, w: the unknowns of the modal node; vp, wp: their rates
  Vec3 x_rate, w_parameters;  ///< ẋ and w(g, ġ)
  Mat3 R;
  Vec3 gravity;  ///< γ, global [m/s²]
  Vec3 w_l, vp_l, wp_l, gravity_l;
};

/// Inertia of the deformed body and the loads of its motion, floating axes (the brackets above,
/// with gravity).
struct FrameDynamics {
  Vec3 S;             ///< S0 + Inv3 q
  Mat3 J;             ///< J0 + A8 + A8ᵀ − A9
  Vec3 momentum;      ///< Inv3 p
  Vec3 spin;          ///< Inv11 p
  Mat3 inertia_rate;  ///< 2 (A8p − A9p) + A10p + A10pᵀ
  Vec3 force, moment;
};

/// Amplitudes and multipliers of one joint inside the state.
struct ModalUnknowns {
  Eigen::Map<const VecX> q, p, q_rate, p_rate;
  const double* reactions;  ///< F, μ of each interface (6 each)
  Vec3 force(int k) const { return Eigen::Map<const Vec3>(reactions + 6 * k); }
  Vec3 couple(int k) const { return Eigen::Map<const Vec3>(reactions + 6 * k + 3); }
};

struct ModalAssemblyPoint;  // in modal_assembly.cpp

class ModalJointSet final : public ElementSet {
 public:
  void add(ElementInfo info, ModalJoint joint) {
    slots_.push_back({std::move(joint), std::move(info), -1, {}, {}});
  }
  const ModalJoint& joint(int i) const { return slots_[i].joint; }
  ModalUnknowns unknowns(const EvalContext& context, int i) const;
  FloatingFrame floating_frame(const EvalContext& context, int i) const;
  int first_mode_row(int i) const { return slots_[i].own + slots_[i].joint.body->modes; }

  int size() const override { return static_cast<int>(slots_.size()); }
  const ElementInfo& info(int i) const override { return slots_[i].info; }
  ElementInfo& info(int i) override { return slots_[i].info; }
  int unknowns(int i) const override;
  bool is_differential(int i, int k) const override { return k < 2 * slots_[i].joint.body->modes; }
  std::string row_name(int i, int k) const override;
  std::vector<int> nodes(int i) const override;
  int first_own(int i) const override { return slots_[i].own; }
  void bind(const Model& model, int i, int first_own) override;
  void collect_pattern(PatternSink& sink) const override;
  void append_rows(const Model& model, int i, std::vector<int>& rows) const override;
  void set_positions(const PositionSource& positions) override;

  void start(const EvalContext& context, State& state, int i) const override;
  /// Amplitudes and velocities stay as the assembly found them.
  void after_assembly(const EvalContext& context, State& state, int i) const override;
  void residual(const EvalContext& context, double* r, ElementRange range) const override;
  void jacobian(const EvalContext& context, const NodeSeeds* seeds, double* values,
                ElementRange range) const override;
  void after_predict(const EvalContext&, State&, ElementRange) const override {}
  void after_convergence(const EvalContext&, State&, ElementRange) const override {}

  AssemblyRole assembly_role(int) const override { return AssemblyRole::custom; }
  void assembly_residual(const EvalContext& context, int i, double* r,
                         double* r_rate) const override;
  void assembly_jacobian(const EvalContext& context, int i, int n,
                         std::vector<Triplet>& out) const override;

  void output(const EvalContext& context, int i, OutputRow& row) const override;
  std::string log_line(const Model& model, int i) const override;
  int private_datum(int i, std::string_view name) const override;
  std::vector<Datum> private_data(int i) const override;
  double private_value(const EvalContext& context, int i, int datum) const override;
  void add_inertia(const EvalContext& context, int i, int node, Inertia& inertia) const override;
  void add_momentum(const EvalContext&, int, State&) const override {}

 private:
  /// A rectangle of the matrix: rows × columns, all in a row in each dimension; or the diagonal of
  /// a square.
  struct Block {
    int row = 0, rows = 0, column = 0, columns = 0;
    bool diagonal = false;
    std::vector<int>
        start;  ///< position of the first entry of each column; −1 rows are not possible

    double& at(double* values, int i, int j) const { return values[start[j] + i]; }
    template <class M>
    void add(double* values, const M& m) const {
      for (int j = 0; j < columns; ++j)
        for (int i = 0; i < rows; ++i) values[start[j] + i] += m(i, j);
    }
    void add_diagonal(double* values, double v) const {
      for (const int p : start) values[p] += v;
    }
  };
  struct InterfaceBlocks {
    Block node_force_f, node_moment_g, node_moment_f;  // node's rows × F; × g of the node; × F, μ
    Block frame_force_f, frame_moment_f, frame_moment_g;  // modal node's rows
    Block modes_f, modes_g;                               // modal rows × F, μ; × g of the node
    Block position_x, position_frame_x;                   // constraint rows × positions
    Block reaction;  // constraint rows × F, μ, when the joint is driven
    Block constraint_g, constraint_frame_g, constraint_q;  // both constraints (6 rows)
  };
  struct Blocks {
    Block velocity_x, velocity_v, spin_g, spin_w;  // definitions of v and w
    Block loads_x, loads_frame, loads_q,
        loads_p;           // force and moment balance × x (central gravity), (g, v, w), q, p
    Block rate_q, rate_p;  // p − q̇
    Block modes_x, modes_frame, modes_q,
        modes_p;  // modal balance × x (central gravity), g [, v, w], q, p
    std::vector<InterfaceBlocks> interfaces;
    std::vector<Block*> all();
  };
  struct Slot {
    ModalJoint joint;
    ElementInfo info;
    int own = -1;  ///< first own unknown
    Blocks blocks;
    VecX zeros;  ///< (M)
  };
  bool modes_are_coupled(const Slot& s) const;
  void bind_interfaces(const Model& model, Slot& s);
  FrameDynamics frame_dynamics(const Slot& s, const FloatingFrame& k, const ModalUnknowns& u) const;
  void inactive_residual(const EvalContext& context, const Slot& s, double* r) const;
  void frame_residual(const Slot& s, const Model& model, const FloatingFrame& k,
                      const ModalUnknowns& u, double* r) const;
  void modes_residual(const Slot& s, const FloatingFrame& k, const ModalUnknowns& u,
                      double* r) const;
  void interface_residual(const EvalContext& context, const Slot& s, int n, const FloatingFrame& k,
                          const ModalUnknowns& u, double* r) const;

  ModalAssemblyPoint assembly_point(const EvalContext& context, int i, int n) const;
  void assembly_interface_jacobian(const EvalContext& context, int i, int k, int n,
                                   std::vector<Triplet>& out) const;

  using Seeds = const NodeSeeds*;
  void inactive_jacobian(const EvalContext& context, const Slot& s, Seeds seeds,
                         double* values) const;
  void definition_jacobian(const EvalContext& context, const Slot& s, Seeds seeds,
                           double* values) const;
  void frame_jacobian(const EvalContext& context, const Slot& s, const FloatingFrame& k,
                      const ModalUnknowns& u, Seeds seeds, double* values) const;
  void coupling_jacobian(const EvalContext& context, const Slot& s, const FloatingFrame& k,
                         const ModalUnknowns& u, Seeds seeds, double* values) const;
  void central_gravity_jacobian(const EvalContext& context, const Slot& s, const FloatingFrame& k,
                                const ModalUnknowns& u, double* values) const;
  void modes_jacobian(const EvalContext& context, const Slot& s, const FloatingFrame& k,
                      double* values) const;
  void interface_jacobian(const EvalContext& context, const Slot& s, int n, const FloatingFrame& k,
                          const ModalUnknowns& u, Seeds seeds, double* values) const;

  std::vector<Slot> slots_;
};

/// The rotation vector of a matrix A that is nearly a rotation, ax(A) φ/sin φ with φ = atan2(|ax
/// A|, (tr A − 1)/2), and its derivative: δ = by_axis · δ(ax A) + by_trace · δ(tr A).
struct NearRotationVector {
  explicit NearRotationVector(const Mat3& a);
  Vec3 value;
  Mat3 by_axis;
  Vec3 by_trace;
};

}  // namespace mbcosim
