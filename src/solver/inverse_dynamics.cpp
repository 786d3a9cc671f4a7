#include "solver/inverse_dynamics.h"

#include <cmath>

#include "elements/beams/inverse_beam.h"
#include "elements/joints/deformable.h"
#include "elements/joints/tikhonov.h"
#include "solver/advance_time.h"
#include "solver/failure.h"
#include "solver/newton.h"
#include "solver/stages.h"
#include "solver/system.h"

namespace mbcosim {

namespace {

/// A stage that has no solution.
struct StageFailure {
  Error error;
};

const ElementSetOf<Beam2>* beams_of(const ElementRef& e) {
  return dynamic_cast<const ElementSetOf<Beam2>*>(e.set);
}
bool is_hinge(const ElementRef& e) {
  return dynamic_cast<const ElementSetOf<DeformableHinge>*>(e.set) ||
         dynamic_cast<const ElementSetOf<DeformableAxialJoint>*>(e.set);
}
std::vector<double> regularization_of(const Model& model, ElementRef joint) {
  for (const auto& set : model.sets)
    if (const auto* all = dynamic_cast<const TikhonovSet*>(set.get()))
      if (auto epsilon = all->coefficients(joint); !epsilon.empty()) return epsilon;
  return {};
}

Vec3 relative_vector(const Mat3& to, const Mat3& from) {
  return vector_of_rotation<double>(to * from.transpose());
}

/// Mass properties for the weight of the inertia.
///
/// N.B. first and second moments about the global origin, not about the node, as in the reference
/// solver: the weights depend on where the model stands.
struct GlobalInertia {
  double m;
  Vec3 S;
  Mat3 J;
  GlobalInertia(const Inertia& about_node, const Vec3& x)
      : m(about_node.m), S(about_node.S + about_node.m * x) {
    const Mat3 xx = cross<double>(x), ss = cross<double>(about_node.S);
    J = about_node.J - m * xx * xx - xx * ss - ss * xx;
  }
};

}  // namespace

InverseDynamics::InverseDynamics(const Model& model)
    : model_(model),
      settings_(*inverse_problem(model)),
      scratch_(std::make_unique<Scratch>(model.scratch)),
      first_(model.structural.size(), -1),
      newton_(newton_settings(model.initial_value)) {
  for (std::size_t k = 0; k < model.structural.size(); ++k) {
    if (model.structural[k].is_dummy()) continue;
    first_[k] = n_;
    nodes_.push_back(static_cast<int>(k));
    n_ += 6;
  }
  for (const ElementRef& e : model.elements) {
    const ElementInfo& info = e.set->info(e.index);
    if (auto constraint = inverse_constraint(e)) {
      joints_.push_back(
          {std::move(constraint), e, settings_.role(info), m_, regularization_of(model, e)});
      m_ += joints_.back().constraint->rows();
    } else if (info.family == Family::body) {
      bodies_.push_back(e);
    } else {
      if (settings_.role(info).ergonomy) ergonomy_.push_back({e, is_hinge(e)});
      if (settings_.role(info).loads) loads_.push_back(e);
    }
  }
}

void InverseDynamics::begin(State& state) const {
  const InitialValueSettings& s = model_.initial_value;
  state.control = {};
  state.control.started = true;
  state.h = state.h_previous = s.time_step;
  state.time = s.initial_time - s.time_step;
  state.step = -1;
}

PhaseReport InverseDynamics::attempt(State& state, const StepAttempt& attempt) {
  PhaseReport report;
  errors_.clear();
  try {
    prepare(state, attempt);
    solve(state, report);
  } catch (const StageFailure& f) {
    char where[96];
    std::snprintf(where, sizeof where, "inverse dynamics at t = %.9g (record %lld): ", state.time,
                  static_cast<long long>(state.step));
    Error e = error_at(state, f.error);
    e.message = where + e.message;
    e.failure.iteration = report.newton.iterations;
    e.failure.residual_history = errors_;
    report.error = std::move(e);
  } catch (const EvaluationError& e) {
    report.error = evaluation_failure(state, e);
  }
  return report;
}

/// Time and references of the next record.
void InverseDynamics::prepare(State& state, const StepAttempt& attempt) {
  if (attempt.end)
    jump_to(state, *attempt.end);
  else
    advance_time(state, attempt.h);
  state.h = state.h_previous = attempt.h;
  ++state.step;
  state.y1 = state.y;
  state.yp1 = state.yp;
  for (const int k : nodes_) {
    NodeRotationHistory& q = state.rotation_history[k];
    q.R_ref = q.R1 = state.rotation[k].R;
    q.w_ref = q.w1 = state.rotation[k].w;
  }
  speed_ = 0;
  for (const int k : nodes_)
    speed_ += Vec3(&state.yp1[model_.structural[k].first]).squaredNorm() +
              state.rotation[k].w.squaredNorm();
  for (const auto& listener : model_.step_listeners)
    listener->advance(context(state), state, state.step == 0);
  update_activity(context(state), state, state.step > 0);
  for (const ElementRef& e : model_.elements) {
    const auto* beams = beams_of(e);
    const InverseRole role = settings_.role(e.set->info(e.index));
    if (!beams) continue;
    if (role.ergonomy || role.loads)
      predict_inverse(*beams, e.index, context(state), state);
    else
      unload(*beams, e.index, state);
  }
}

void InverseDynamics::solve(State& state, PhaseReport& report) {
  solve_position(state, report);
  solve_velocity(state);
  solve_acceleration(state);
  solve_forces(state);
  finish(state);
  report.newton.iterations += settings_.underdetermined ? 3 : 1;
}

// ------------------------------------------------------------------------------------------------
// stages

void InverseDynamics::solve_position(State& state, PhaseReport& report) {
  NewtonReport& newton = report.newton;
  newton.tolerance = newton_.tolerance;
  double correction = HUGE_VAL;
  for (int iteration = 0;; ++iteration) {
    if (cancel_ && cancel_->cancelled())
      throw StageFailure{cancelled_error("interrupted between iterations")};
    const VecX right = right_side(state, kPosition, iteration == 0);
    newton.iterations = iteration;
    newton.residual_error = residual_error(right);
    newton.solution_error = std::isfinite(correction) ? correction : 0;
    errors_.push_back(newton.residual_error);
    newton.by_solution = !meets_tolerance(newton_, newton.residual_error) && is_settled(correction);
    if (newton.by_solution) return;
    if (const auto verdict = judge(newton_, errors_, iteration)) {
      if (*verdict == NewtonOutcome::converged) return;
      char text[120];
      std::snprintf(
          text, sizeof text,
          "no convergence of the positions in %d iterations, residual %.6g, tolerance %.6g",
          iteration, newton.residual_error, newton_.tolerance);
      throw StageFailure{
          make_error(ErrorKind::not_converged, "NOT_CONVERGED",
                     text + obstacle(right, newton.residual_error < errors_.front()))};
    }
    const VecX delta = solved(kPosition, matrix(state, kPosition, iteration == 0), right);
    correct_position(delta, state);
    correction = newton_.solution_test == ResidualTest::minmax
                     ? delta.head(n_).cwiseAbs().maxCoeff()
                     : delta.head(n_).norm();
  }
}

std::string InverseDynamics::obstacle(const VecX& right, bool improved) const {
  std::string text;
  Eigen::Index worst = 0;
  if (m_ > 0) (void)right.tail(m_).cwiseAbs().maxCoeff(&worst);
  for (const Joint& j : joints_)
    if (worst >= j.row && worst < j.row + j.constraint->rows())
      text = "\n  " + model_.element_text(j.element) + ", equation " +
             std::to_string(worst - j.row + 1) + ": farthest from its prescribed motion";
  return text + "\n  hint: " +
         (improved ? "the iteration comes nearer: allow more `max iterations` (1 when the card is "
                     "missing)"
                   : "allow more `max iterations` (1 when the card is missing); when that does not "
                     "help, the prescribed motions are out of reach or jump: check them, or start "
                     "from positions of the nodes that are nearer");
}

double InverseDynamics::residual_error(const VecX& right) const {
  const InitialValueSettings& s = model_.initial_value;
  const bool all = !settings_.underdetermined || settings_.full_residual_test;
  const VecX tested = all ? right : VecX(right.tail(m_));
  double error = s.residual_test == ResidualTest::minmax
                     ? (tested.size() ? tested.cwiseAbs().maxCoeff() : 0.0)
                     : tested.norm();
  if (s.modify_residual_test) error /= 1 + speed_;
  return error;
}

bool InverseDynamics::is_settled(double correction) const {
  return newton_.solution_test != ResidualTest::none && correction <= newton_.solution_tolerance;
}

/// The rotation parameters of a record start from those of the record before.
void InverseDynamics::correct_position(const VecX& delta, State& state) const {
  for (const int k : nodes_) {
    double* y = &state.y[model_.structural[k].first];
    for (int i = 0; i < 6; ++i) y[i] += delta(first_[k] + i);
    state.rotation[k].R = cgr_rotation(Vec3(y + 3)) * state.rotation_history[k].R_ref;
  }
  if (settings_.underdetermined)
    for (int i = 0; i < m_; ++i) state.memory[settings_.multipliers + i] += delta(n_ + i);
}

void InverseDynamics::solve_velocity(State& state) {
  const VecX z =
      solved(kVelocity, matrix(state, kVelocity, false), right_side(state, kVelocity, false));
  for (const int k : nodes_) {
    const Vec3 w = z.segment<3>(first_[k] + 3);
    state.rotation[k].w = w;
    double* rate = &state.yp[model_.structural[k].first];
    for (int i = 0; i < 6; ++i) rate[i] = z(first_[k] + i);
  }
}

void InverseDynamics::solve_acceleration(State& state) {
  const VecX z = solved(kAcceleration, matrix(state, kAcceleration, false),
                        right_side(state, kAcceleration, false));
  for (const int k : nodes_)
    for (int i = 0; i < 6; ++i) state.memory[settings_.memory + 6 * k + i] = z(first_[k] + i);
}

void InverseDynamics::solve_forces(State& state) {
  const VecX right = right_side(state, kForces, false);
  const VecX z = solved(kForces, matrix(state, kForces, false), right);
  const int first = settings_.underdetermined ? n_ : 0;
  for (const Joint& j : joints_) {
    const ElementRef e = j.constraint->joint();
    for (int i = 0; i < j.constraint->rows(); ++i)
      state.y[e.set->first_own(e.index) + i] = z(first + j.row + i);
  }
}

void InverseDynamics::finish(State& state) const {
  for (const Joint& j : joints_)
    if (takes_part(state, j, kPosition)) j.constraint->accept(context(state), state);
  accumulate(context(state));
  for (const ElementSpan& s : model_.stage_order)
    if (!inverse_constraint({s.set, s.range.first}))
      s.set->after_convergence(context(state), state, s.range);
  for (const auto& listener : model_.step_listeners)
    listener->after_convergence(context(state), state);
  for (const ElementRef& e : model_.elements)
    if (const auto* beams = beams_of(e); beams && !settings_.role(e.set->info(e.index)).ergonomy)
      accept_reference(*beams, e.index, state);
}

// ------------------------------------------------------------------------------------------------
// equations

bool InverseDynamics::takes_part(const State& state, const Joint& j, Stage stage) const {
  const ElementRef e = j.constraint->joint();
  if (!e.set->is_active(state, e.index)) return false;
  if (!settings_.underdetermined) return true;
  return stage == kForces ? j.role.torque : j.role.prescribed;
}

VecX InverseDynamics::constraint_values(const State& state, Stage stage) const {
  const EvalContext c = context(state);
  VecX values = VecX::Zero(m_);
  for (const Joint& j : joints_) {
    auto rows = values.segment(j.row, j.constraint->rows());
    if (!takes_part(state, j, stage)) {
      if (stage == kPosition)
        rows = -VecX::Map(&state.memory[settings_.multipliers + j.row], rows.size());
    } else if (stage == kPosition) {
      rows = j.constraint->position(c);
    } else if (stage == kVelocity) {
      rows = j.constraint->velocity(c);
    } else if (stage == kAcceleration) {
      rows = j.constraint->acceleration(c);
    }
  }
  return values;
}

VecX InverseDynamics::right_side(const State& state, Stage stage, bool first) const {
  if (!settings_.underdetermined)
    return stage == kForces ? loads(state) : constraint_values(state, stage);
  VecX right = VecX::Zero(n_ + m_);
  if (stage == kForces) {
    right.head(n_) = loads(state);
    return right;
  }
  right.tail(m_) = constraint_values(state, stage);
  add_change_weight(state, stage, right);
  add_inertia_weight(state, stage, right);
  if (stage == kPosition) add_springs(state, first, right);
  return right;
}

void InverseDynamics::add_change_weight(const State& state, Stage stage, VecX& right) const {
  const double weight = settings_.change_weight[stage];
  if (weight == 0) return;
  for (const int k : nodes_) {
    const int first = model_.structural[k].first;
    const NodeRotationHistory& past = state.rotation_history[k];
    const Vec3 x(&state.y[first]), x_p(&state.y1[first]), v(&state.yp[first]),
        v_p(&state.yp1[first]);
    auto rows = right.segment<6>(first_[k]);
    if (stage == kPosition) {
      rows.head<3>() += weight * (x_p - x);
      rows.tail<3>() += weight * relative_vector(past.R1, state.rotation[k].R);
    } else if (stage == kVelocity) {
      rows.head<3>() += weight / state.h * (x - x_p);
      rows.tail<3>() += weight / state.h * relative_vector(state.rotation[k].R, past.R1);
    } else {
      rows.head<3>() += weight / state.h * (v - v_p);
      rows.tail<3>() += weight / state.h * (state.rotation[k].w - past.w1);
    }
  }
}

/// Wants the change (position) or the last record's value (velocity, acceleration) of each body.
void InverseDynamics::add_inertia_weight(const State& state, Stage stage, VecX& right) const {
  const double weight = settings_.inertia_weight[stage];
  if (weight == 0) return;
  const EvalContext c = context(state);
  for (const ElementRef& e : bodies_) {
    if (!settings_.role(e.set->info(e.index)).ergonomy || !e.set->is_active(state, e.index))
      continue;
    const int k = e.set->nodes(e.index)[0], first = model_.structural[k].first;
    Inertia about_node;
    e.set->add_inertia(c, e.index, k, about_node);
    const Vec3 x(&state.y[first]);
    const GlobalInertia body(about_node, x);
    const NodeRotationHistory& past = state.rotation_history[k];
    const double* acceleration = &state.memory[settings_.memory + 6 * k];
    Vec3 A, B;
    if (stage == kPosition) {
      A = Vec3(&state.y1[first]) - x;
      B = relative_vector(past.R1, state.rotation[k].R);
    } else if (stage == kVelocity) {
      A = Vec3(&state.yp1[first]);
      B = past.w1;
    } else {
      A = Vec3(acceleration);
      B = Vec3(acceleration + 3);
    }
    auto rows = right.segment<6>(first_[k]);
    rows.head<3>() += weight * (body.m * A - body.S.cross(B));
    rows.tail<3>() += weight * (body.S.cross(A) + body.J * B);
  }
}

/// N.B. as in the reference solver the coupling of translation and rotation is that of the last
/// body of a node, not of all.
void InverseDynamics::add_weight_matrix(const State& state, Stage stage, Triplets& out) const {
  const double change = settings_.change_weight[stage], inertia = settings_.inertia_weight[stage];
  for (int i = 0; change != 0 && i < n_; ++i) out.emplace_back(i, i, change);
  if (inertia == 0) return;
  std::vector<Mat3> coupling(model_.structural.size(), Mat3::Zero());
  const EvalContext c = context(state);
  for (const ElementRef& e : bodies_) {
    if (!settings_.role(e.set->info(e.index)).ergonomy || !e.set->is_active(state, e.index))
      continue;
    const int k = e.set->nodes(e.index)[0];
    Inertia about_node;
    e.set->add_inertia(c, e.index, k, about_node);
    const GlobalInertia body(about_node, Vec3(&state.y[model_.structural[k].first]));
    coupling[k] = inertia * cross<double>(body.S);
    for (int i = 0; i < 3; ++i) {
      out.emplace_back(first_[k] + i, first_[k] + i, inertia * body.m);
      for (int j = 0; j < 3; ++j)
        out.emplace_back(first_[k] + 3 + i, first_[k] + 3 + j, inertia * body.J(i, j));
    }
  }
  for (const int k : nodes_)
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) {
        out.emplace_back(first_[k] + 3 + i, first_[k] + j, coupling[k](i, j));
        out.emplace_back(first_[k] + i, first_[k] + 3 + j, -coupling[k](i, j));
      }
}

void InverseDynamics::add_rows(const State& state, Stage stage, bool transposed,
                               Triplets& out) const {
  const EvalContext c = context(state);
  const int first_row = settings_.underdetermined ? n_ : 0;
  for (const Joint& j : joints_) {
    const int rows = j.constraint->rows(), row = first_row + j.row;
    if (!takes_part(state, j, stage)) {
      for (int i = 0; i < rows; ++i) out.emplace_back(row + i, row + i, 1.0);
      continue;
    }
    const MatX J = j.constraint->jacobian(c, state.rotation_history);
    const std::vector<int> nodes = j.constraint->nodes();
    for (int i = 0; i < rows; ++i)
      for (int k = 0; k < J.cols(); ++k) {
        const int column = first_[nodes[k / 6]] + k % 6;
        if (!transposed || settings_.underdetermined) out.emplace_back(row + i, column, J(i, k));
        if (transposed || settings_.underdetermined) out.emplace_back(column, row + i, J(i, k));
      }
    if (stage == kForces)
      for (std::size_t i = 0; i < j.epsilon.size(); ++i)
        out.emplace_back(row + i, row + i, -j.epsilon[i]);
  }
}

InverseDynamics::Sparse InverseDynamics::matrix(const State& state, Stage stage, bool first) const {
  Triplets entries;
  add_rows(state, stage, stage == kForces, entries);
  if (settings_.underdetermined && stage != kForces) add_weight_matrix(state, stage, entries);
  if (settings_.underdetermined && stage == kPosition) add_spring_matrix(state, first, entries);
  const int size = settings_.underdetermined ? n_ + m_ : n_;
  Sparse m(size, size);
  m.setFromTriplets(entries.begin(), entries.end());
  return m;
}

VecX InverseDynamics::solved(Stage stage, const Sparse& matrix, const VecX& right) {
  if (matrix.rows() == 0) return right;
  ++factorizations_;
  VecX z;
  try {
    SparseFactors& lu = factors_[stage];
    lu.factor(matrix, Watch(cancel_));
    if (lu.regular()) z = lu.solve(right);
  } catch (const Stopped&) {
    throw StageFailure{cancelled_error("interrupted within an iteration")};
  }
  static constexpr std::array kNames = {"position", "velocity", "acceleration", "force"};
  constexpr double kLost = 1e-6;  // of the right hand side: nothing of the solution is left
  if (z.size() == 0 || !z.allFinite() || (matrix * z - right).norm() > kLost * (1 + right.norm()))
    throw StageFailure{make_error(
        ErrorKind::singular, "SINGULAR_MATRIX",
        std::string("the matrix of the ") + kNames[stage] + " stage is singular\n  hint: " +
            (stage == kForces
                 ? "the joints with `torque` must determine all forces, once; redundant "
                   "ones share them with `joint regularization`"
                 : "prescribed motions contradict or repeat each other, or, without "
                   "weights and ergonomy, leave something free"))};
  return z;
}

// ------------------------------------------------------------------------------------------------
// springs and loads

/// The state at the references of the record: orientations of the record before, no increment.
State InverseDynamics::reference(const State& state) const {
  State r = state;
  for (const int k : nodes_) {
    r.rotation[k].R = state.rotation_history[k].R_ref;
    for (int i = 3; i < 6; ++i) r.y[model_.structural[k].first + i] = 0;
  }
  return r;
}

VecX InverseDynamics::with_nodes(const std::vector<double>& residual) const {
  VecX f(n_);
  for (const int k : nodes_)
    f.segment<6>(first_[k]) = Eigen::Map<const Vec6>(&residual[model_.structural[k].equilibrium]);
  return f;
}

VecX InverseDynamics::spring_force(const State& state, const Spring& spring) const {
  std::vector<double> r(model_.unknowns, 0.0);
  const int i = spring.element.index;
  spring.element.set->residual(context(state), r.data(), {i, i + 1});
  return with_nodes(r);
}

/// The first residual of a record is evaluated at its references.
void InverseDynamics::add_springs(const State& state, bool first, VecX& right) const {
  if (ergonomy_.empty()) return;
  const State at = first ? reference(state) : state;
  accumulate(context(at));
  for (const Spring& s : ergonomy_)
    if (s.element.set->is_active(state, s.element.index)) right.head(n_) += spring_force(at, s);
}

/// Stiffness at the references; hinges with their moments as they are.
void InverseDynamics::add_spring_matrix(const State& state, bool first, Triplets& out) const {
  if (ergonomy_.empty()) return;
  const State base = reference(state);
  std::vector<double> values(model_.row_index.size(), 0.0);
  const std::vector<NodeSeeds> seeds(model_.structural.size(),
                                     NodeSeeds{Mat3::Identity(), Mat3::Zero()});
  accumulate(context(base));
  for (const Spring& s : ergonomy_) {
    const int i = s.element.index;
    if (!s.element.set->is_active(state, i)) continue;
    s.element.set->jacobian(context(base), seeds.data(), values.data(), {i, i + 1});
    if (!s.is_hinge || first) continue;
    const std::vector<int> nodes = s.element.set->nodes(i);
    const Vec3 change =
        (spring_force(state, s) - spring_force(base, s)).segment<3>(first_[nodes[0]] + 3);
    const Mat3 m = cross<double>(change);
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < 3; ++b) {
        out.emplace_back(first_[nodes[0]] + 3 + a, first_[nodes[0]] + 3 + b, m(a, b));
        out.emplace_back(first_[nodes[1]] + 3 + a, first_[nodes[0]] + 3 + b, -m(a, b));
      }
  }
  std::vector<int> local(model_.unknowns, -1);
  for (const int k : nodes_)
    for (int i = 0; i < 6; ++i) local[model_.structural[k].equilibrium + i] = first_[k] + i;
  for (const int k : nodes_)
    for (int j = 0; j < 6; ++j) {
      const int column = model_.structural[k].first + j;
      for (int p = model_.column_start[column]; p < model_.column_start[column + 1]; ++p)
        if (local[model_.row_index[p]] >= 0 && values[p] != 0)
          out.emplace_back(local[model_.row_index[p]], first_[k] + j, values[p]);
    }
}

VecX InverseDynamics::loads(const State& state) const {
  std::vector<double> r(model_.unknowns, 0.0), late(model_.unknowns, 0.0);
  bool has_late = false;
  accumulate(context(state));
  for (const ElementRef& e : loads_) {
    if (!e.set->is_active(state, e.index)) continue;
    // Beams that only load the nodes are one record late, as in the reference solver.
    const bool by_reference = beams_of(e) && !settings_.role(e.set->info(e.index)).ergonomy;
    has_late |= by_reference;
    if (!by_reference) e.set->residual(context(state), r.data(), {e.index, e.index + 1});
  }
  if (has_late) {
    const State base = reference(state);
    accumulate(context(base));
    for (const ElementRef& e : loads_)
      if (beams_of(e) && !settings_.role(e.set->info(e.index)).ergonomy &&
          e.set->is_active(state, e.index))
        e.set->residual(context(base), late.data(), {e.index, e.index + 1});
  }
  VecX f = with_nodes(r) + with_nodes(late);
  if (!state.external_loads.empty())
    for (const int k : nodes_)
      f.segment<6>(first_[k]) += Eigen::Map<const Vec6>(&state.external_loads[6 * k]);
  add_body_loads(state, f);
  return f;
}

/// Inertia forces and weight.
///
/// N.B. the gyroscopic moment w × (J_cg w) is missing, as in the reference solver.
void InverseDynamics::add_body_loads(const State& state, VecX& f) const {
  const EvalContext c = context(state);
  for (const ElementRef& e : bodies_) {
    if (!settings_.role(e.set->info(e.index)).loads || !e.set->is_active(state, e.index)) continue;
    const int k = e.set->nodes(e.index)[0];
    Inertia body;
    e.set->add_inertia(c, e.index, k, body);
    if (!(body.m > 0)) continue;
    const NodeState s = model_.node_state(c, k);
    const NodeAcceleration now = model_.node_acceleration(c, k);
    const Vec3 arm = body.S / body.m, weight = model_.gravity_at(c, s.x + arm),
               inward = s.w.cross(Vec3(s.w.cross(arm)));
    auto rows = f.segment<6>(first_[k]);
    rows.head<3>() -= body.m * (now.a + now.wp.cross(arm) + inward - weight);
    rows.tail<3>() -= body.J * now.wp + body.S.cross(Vec3(now.a + inward - weight));
  }
}

}  // namespace mbcosim
