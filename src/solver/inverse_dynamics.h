/// Inverse dynamics: the motion of some points is prescribed; position, velocity, acceleration and
/// forces are found at each instant, without integration in time.
#pragma once

#include <Eigen/Sparse>
#include <array>
#include <memory>
#include <vector>

#include "elements/joints/inverse_constraint.h"
#include "model/inverse_problem.h"
#include "solver/cancel.h"
#include "solver/sparse_factors.h"
#include "solver/step_controller.h"

namespace mbcosim {

/// One record is four stages with the unknowns z of n node components (x, φ of each node) and the m
/// rows of the joints:
///
///   position      c(x, R) = 0 by Newton's method: J δ = c, x += δx, g += δg, R = R(g) R_previous
///   velocity      J (v, w) = c_v
///   acceleration  J (a, ẇ) = c_a
///   forces        Jᵀ λ = f, f the loads on the nodes, inertia forces included
///
/// Fully actuated: J is square. Underdetermined: the stages of the motion minimize a quadratic form
/// subject to the constraints of prescribed motion (P), and the forces are those of the joints with
/// torque (T):
///
///   [ W   J_Pᵀ ] [ z ]   [ r ]          [ 0    J_Tᵀ ] [ · ]   [ f ]
///   [ J_P  0   ] [ · ] = [ c ]          [ J_T   −ε  ] [ λ ] = [ 0 ]
///
/// W and r weigh the change since the last record, the inertia and, in the position stage, the
/// elastic energy of elements with ergonomy; ε: Tikhonov regularizations, which share the load
/// among redundant actuators.
///
/// In State: y has x and g, which is not reset between records; yp the velocities; R_ref of
/// NodeRotationHistory is R_previous; y1, yp1, w1 are those of the record before; accelerations lie
/// in the memory at InverseProblem::memory. There, too, is the sum of each row's multipliers of all
/// position stages: while a row takes no part in them, its equation takes the sum back to zero (as
/// in the reference solver, whose count of iterations depends on it).
///
/// The position stage iterates on its own, not by solver/newton.h: its unknowns are positions and
/// multipliers of a minimum, which no integrator follows, in a matrix of its own pattern. The test
/// of convergence is that of newton.h. Source: MBDyn input manual;
/// P. Masarati et al., "Efficient inverse kinematics and dynamics of redundant manipulators", 2011.
class InverseDynamics final : public StepSystem {
 public:
  explicit InverseDynamics(const Model& model);

  void set_cancelled(const CancelToken* cancel) { cancel_ = cancel; }
  /// The state one step before the first record.
  void begin(State& state) const;
  /// The record one time step after the state.
  PhaseReport attempt(State& state, const StepAttempt& attempt) override;
  double next_step_size(State& state) const override { return peek_step_size(state); }
  double peek_step_size(const State&) const override { return model_.initial_value.time_step; }
  double retry_step_size(State&, double) const override { return 0; }
  bool can_retry() const override { return false; }
  void explain(PhaseReport&, const State&) override {}
  std::int64_t factorizations() const { return factorizations_; }  ///< so far

 private:
  enum Stage { kPosition, kVelocity, kAcceleration, kForces };  ///< the first three index weights
  struct Joint {
    std::unique_ptr<InverseConstraint> constraint;
    ElementRef element;
    InverseRole role;
    int row;                      ///< first of its rows among those of all joints
    std::vector<double> epsilon;  ///< of its regularization (rows), or empty
  };
  /// An elastic element whose energy is minimized, or a beam that loads the nodes.
  struct Spring {
    ElementRef element;
    bool is_hinge;
  };
  using Triplets = std::vector<Eigen::Triplet<double>>;
  using Sparse = Eigen::SparseMatrix<double>;

  EvalContext context(const State& state) const {
    EvalContext c = model_.context(state, Phase::step, 1, 1);
    c.scratch = scratch_.get();
    return c;
  }
  bool takes_part(const State& state, const Joint& j, Stage stage) const;
  void prepare(State& state, const StepAttempt& attempt);
  void solve(State& state, PhaseReport& report);
  void solve_position(State& state, PhaseReport& report);
  /// Has the last correction met the solution test?
  bool is_settled(double correction) const;
  double residual_error(const VecX& right) const;
  /// The joint with the largest residual in the position stage, and what to do.
  std::string obstacle(const VecX& right, bool improved) const;
  void correct_position(const VecX& delta, State& state) const;
  void solve_velocity(State& state);
  void solve_acceleration(State& state);
  void solve_forces(State& state);
  void finish(State& state) const;

  VecX constraint_values(const State& state, Stage stage) const;
  VecX right_side(const State& state, Stage stage, bool first) const;
  Sparse matrix(const State& state, Stage stage, bool first) const;
  void add_rows(const State& state, Stage stage, bool transposed, Triplets& out) const;
  void add_change_weight(const State& state, Stage stage, VecX& right) const;
  void add_inertia_weight(const State& state, Stage stage, VecX& right) const;
  void add_weight_matrix(const State& state, Stage stage, Triplets& out) const;
  void add_springs(const State& state, bool first, VecX& right) const;
  void add_spring_matrix(const State& state, bool first, Triplets& out) const;
  VecX loads(const State& state) const;
  void add_body_loads(const State& state, VecX& f) const;
  VecX solved(Stage stage, const Sparse& matrix, const VecX& right);
  VecX with_nodes(const std::vector<double>& residual) const;
  State reference(const State& state) const;
  VecX spring_force(const State& state, const Spring& spring) const;

  const Model& model_;
  const InverseProblem& settings_;
  const std::unique_ptr<Scratch> scratch_;  ///< of elements
  const CancelToken* cancel_ = nullptr;
  std::vector<int> nodes_;  ///< structural nodes with unknowns
  std::vector<int> first_;  ///< first of the six columns of a structural node, -1: none
  std::vector<Joint> joints_;
  std::vector<Spring> ergonomy_;
  std::vector<ElementRef> bodies_, loads_;
  int n_ = 0, m_ = 0;  ///< node components, rows of all joints
  double speed_ = 0;   ///< Σ of squares of the last record's velocities
  std::int64_t factorizations_ = 0;
  std::array<SparseFactors, 4>
      factors_;  ///< by stage: their orders of elimination are of use again
  const NewtonSettings newton_;
  std::vector<double> errors_;  ///< of the position stage, by iterations
};

}  // namespace mbcosim
