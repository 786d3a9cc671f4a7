#include "solver/initial_assembly.h"

#include <Eigen/Sparse>
#include <map>
#include <memory>
#include <optional>

#include "model/model_part.h"
#include "model/user_elements.h"
#include "solver/failure.h"
#include "solver/newton.h"
#include "solver/null_space.h"
#include "solver/singularity.h"
#include "solver/sparse_factors.h"
#include "solver/stages.h"
#include "solver/watch.h"

namespace mbcosim {

namespace {

class Assembly {
 public:
  Assembly(const Model& model, State& state, const CancelToken* cancel)
      : model_(model),
        state_(state),
        start_(state),
        cancel_(cancel),
        interruption_(interruption_by(cancel)),
        scratch_(std::make_unique<Scratch>(model.scratch)),
        n_(model.unknowns),
        to_local_(2 * n_, -1) {
    for (const ElementRef& e : model.elements)
      if (is_assembled(e)) elements_.push_back(e);
    number();
  }
  bool needed() const { return !elements_.empty(); }

  Result<AssemblyReport> run() {
    NewtonSettings test;
    test.tolerance = model_.control.assembly_tolerance;
    test.max_iterations = model_.control.assembly_max_iterations;
    AssemblyReport report;
    for (;; ++report.iterations) {
      compute_residual();
      report.error = error(report.moved || !bears_velocities());
      errors_.push_back(report.error);
      if (const auto verdict = judge(test, errors_, report.iterations))
        return *verdict == NewtonOutcome::converged ? polish(report)
                                                    : failure(ErrorKind::not_converged, report);
      if (is_cancelled()) return stopped(report);
      if (!correct()) return failure(ErrorKind::singular, report);
      report.moved = true;
    }
  }

 private:
  /// Nodes that were moved get one more correction: what is left of a violation is divided by the
  /// square of a small number in the derivatives phase. Consistent input stays as it is.
  Result<AssemblyReport> polish(AssemblyReport& report) {
    if (report.moved && !correct()) return failure(ErrorKind::singular, report);
    return report;
  }

  bool is_cancelled() const { return cancel_ && cancel_->cancelled(); }
  Error stopped(const AssemblyReport& report) const {
    return at_iteration(cancelled_error("initial assembly: interrupted between iterations"),
                        report);
  }
  Error at_iteration(Error error, const AssemblyReport& report) const {
    error.failure.iteration = report.iterations;
    error.failure.residual_history = errors_;
    return error_at(state_, std::move(error));
  }

  bool is_assembled(const ElementRef& e) const {
    if (e.set->assembly_role(e.index) == AssemblyRole::none || !e.set->is_active(state_, e.index))
      return false;
    switch (e.set->info(e.index).family) {
      case Family::force:
        return model_.control.assemble_forces;
      case Family::loadable:
        return find_part<UserElementsInAssembly>(model_) != nullptr;
      default:
        return true;
    }
  }

  /// Local numbering: position level first, then the rate level. Node rows are the equilibrium
  /// rows, columns x and g.
  void number() {
    for (const StructuralNode& node : model_.structural)
      for (int i = 0; i < node.position_unknowns(); ++i) {
        rows_.push_back(node.equilibrium + i);
        columns_.push_back(node.first + i);
      }
    node_rows_ = static_cast<int>(rows_.size());
    is_velocity_.assign(node_rows_, false);
    for (const ElementRef& e : elements_)
      for (int k = 0; k < e.set->unknowns(e.index); ++k) {
        rows_.push_back(e.set->first_own(e.index) + k);
        columns_.push_back(rows_.back());
        is_velocity_.push_back(e.set->constrains_velocity(e.index, k));
      }
    size_ = static_cast<int>(rows_.size());
    row_of_.assign(2 * n_, -1);
    for (int a = 0; a < size_; ++a) {
      to_local_[columns_[a]] = a;
      to_local_[n_ + columns_[a]] = size_ + a;
      row_of_[rows_[a]] = a;
      row_of_[n_ + rows_[a]] = size_ + a;
    }
    r_.assign(n_, 0);
    r_rate_.assign(n_, 0);
  }

  /// With the sums over elements at the state.
  EvalContext context() const {
    EvalContext c = model_.context(state_, Phase::assembly);
    c.scratch = scratch_.get();
    accumulate(c);
    return c;
  }

  Vec3 rotation_parameters(std::size_t k) const {
    return cgr_parameters<double>(state_.rotation[k].R * start_.rotation[k].R.transpose());
  }

  void compute_residual() {
    std::fill(r_.begin(), r_.end(), 0.0);
    std::fill(r_rate_.begin(), r_rate_.end(), 0.0);
    const EvalContext c = context();
    for (std::size_t k = 0; k < model_.structural.size(); ++k) {
      const StructuralNode& node = model_.structural[k];
      if (node.is_dummy()) continue;
      const double kp = node.assembly_position_stiffness, kv = node.assembly_velocity_stiffness;
      for (int i = 0; i < 3; ++i) {
        r_[node.equilibrium + i] += kp * (start_.y[node.first + i] - state_.y[node.first + i]);
        r_rate_[node.equilibrium + i] +=
            kv * (start_.yp[node.first + i] - state_.yp[node.first + i]);
      }
      if (!node.has_rotation()) continue;
      const Vec3 g = rotation_parameters(k);
      const NodeRotation& q = state_.rotation[k];
      const Vec3 w0 = node.omega_rotates
                          ? Vec3(start_.rotation[k].R * q.R.transpose() * start_.rotation[k].w)
                          : start_.rotation[k].w;
      for (int i = 0; i < 3; ++i) {
        r_[node.equilibrium + 3 + i] -= kp * g(i);
        r_rate_[node.equilibrium + 3 + i] += kv * (w0(i) - q.w(i));
      }
    }
    const EvaluationWatch watch(interruption_);
    for (const ElementRef& e : elements_) {
      e.set->assembly_residual(c, e.index, r_.data(), r_rate_.data());
      EvaluationWatch::count(EvaluationWatch::kOfElement);
    }
  }

  /// Is all that contradicts velocity constraints little enough for the derivatives phase, which
  /// keeps the velocities? Newton's method would turn it by way of dampers, whose forces the
  /// initial stiffness alone balances, into far motions.
  bool bears_velocities() const {
    return velocity_error() <= model_.initial_value.derivatives_tolerance;
  }
  double velocity_error() const {
    double r2 = 0;
    for (int a = 0; a < size_; ++a)
      if (is_velocity_[a]) r2 += r_rate_[rows_[a]] * r_rate_[rows_[a]];
    return std::sqrt(r2);
  }

  double error(bool with_velocities) const {
    double r2 = 0, x2 = 1;
    for (int a = 0; a < size_; ++a) {
      const double rate = with_velocities || !is_velocity_[a] ? r_rate_[rows_[a]] : 0;
      r2 += r_[rows_[a]] * r_[rows_[a]] + rate * rate;
      const double x = state_.y[columns_[a]], v = state_.yp[columns_[a]];
      x2 += x * x + v * v;
    }
    return std::sqrt(r2 / x2);
  }

  /// −∂r/∂δ.
  Eigen::SparseMatrix<double> matrix() const {
    std::vector<ElementSet::Triplet> entries;
    add_springs(entries);
    const EvalContext c = context();
    for (const ElementRef& e : elements_) e.set->assembly_jacobian(c, e.index, n_, entries);
    std::vector<Eigen::Triplet<double>> triplets;
    for (const auto& t : entries) {
      const int row = row_of_[t.row], column = to_local_[t.column];
      if (row >= 0 && column >= 0) triplets.emplace_back(row, column, t.value);
    }
    Eigen::SparseMatrix<double> m(2 * size_, 2 * size_);
    m.setFromTriplets(triplets.begin(), triplets.end());
    return m;
  }

  bool correct() {
    factors_.factor(matrix(), Watch(cancel_));
    if (!factors_.regular()) return false;
    VecX rhs(2 * size_);
    for (int a = 0; a < size_; ++a) {
      rhs(a) = r_[rows_[a]];
      rhs(size_ + a) = r_rate_[rows_[a]];
    }
    const VecX delta = factors_.solve(rhs) * model_.control.assembly_epsilon;
    if (!delta.allFinite()) return false;
    apply(delta);
    return true;
  }

  void add_springs(std::vector<ElementSet::Triplet>& entries) const {
    for (std::size_t k = 0; k < model_.structural.size(); ++k) {
      const StructuralNode& node = model_.structural[k];
      if (node.is_dummy()) continue;
      const double kp = node.assembly_position_stiffness, kv = node.assembly_velocity_stiffness;
      for (int i = 0; i < 3; ++i) {
        entries.push_back({node.equilibrium + i, node.first + i, kp});
        entries.push_back({n_ + node.equilibrium + i, n_ + node.first + i, kv});
      }
      if (!node.has_rotation()) continue;
      const Mat3 g_inverse = cgr_g_inverse(rotation_parameters(k));
      for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j)
          entries.push_back({node.equilibrium + 3 + i, node.first + 3 + j, kp * g_inverse(i, j)});
        entries.push_back({n_ + node.equilibrium + 3 + i, n_ + node.first + 3 + i, kv});
      }
    }
  }

  void apply(const VecX& delta) {
    for (std::size_t k = 0; k < model_.structural.size(); ++k) {
      const StructuralNode& node = model_.structural[k];
      if (!node.has_rotation()) continue;
      const int a = to_local_[node.first + 3];
      NodeRotation& q = state_.rotation[k];
      q.R = rotation_of_vector<double>(delta.segment<3>(a)) * q.R;
      q.w += delta.segment<3>(size_ + a);
    }
    for (int a = 0; a < size_; ++a) {
      state_.y[columns_[a]] += delta(a);
      state_.yp[columns_[a]] += delta(size_ + a);
    }
  }

  Error failure(ErrorKind kind, const AssemblyReport& report) {
    const bool singular = kind == ErrorKind::singular;
    std::vector<double> worst(n_);
    for (int i = 0; i < n_; ++i) worst[i] = std::max(std::abs(r_[i]), std::abs(r_rate_[i]));
    char text[160];
    std::snprintf(text, sizeof text,
                  "initial assembly: error %.6g after %d iterations, tolerance %.6g", report.error,
                  report.iterations, model_.control.assembly_tolerance);
    Error e =
        at_iteration(make_error(kind, singular ? "ASSEMBLY_SINGULAR" : "ASSEMBLY_NOT_CONVERGED",
                                singular ? "initial assembly: the matrix is singular" : text),
                     report);
    e.failure.worst = worst_equations(model_, worst);
    const std::string reason = diagnosis();
    if (!reason.empty()) {
      e.message += "\n  " + reason;
      return e;
    }
    for (const WorstEquation& w : e.failure.worst) {
      std::snprintf(text, sizeof text, "%.6g", w.residual);
      if (w.residual != 0) e.message += "\n  " + w.owner + ", " + w.equation + ": " + text;
    }
    return e;
  }

  /// Why the assembly failed: constraints that contradict each other, or that follow from each
  /// other; empty when neither is found. Tries more iterations, and then looks for the
  /// configuration that violates the constraints least.
  std::string diagnosis() {
    const int iterations = size_ > 20000 ? 10 : 60;
    state_ = start_;
    compute_residual();
    if (error(false) <= model_.control.assembly_tolerance) return contradicted_velocities();
    for (int k = 1; k <= iterations && !is_cancelled() && correct(); ++k) {
      compute_residual();
      if (error(true) <= model_.control.assembly_tolerance)
        return "the constraints are met after " + std::to_string(k) +
               " iterations: allow as many with `max initial iterations`, or give positions "
               "nearer to the assembled ones";
    }
    state_ = start_;
    compute_residual();
    const std::vector<double> input = r_;
    const bool complied = comply(iterations);
    if (is_cancelled()) return {};
    if (complied) {
      if (std::string fight = contradictions(input); !fight.empty()) return fight;
    } else {
      state_ = start_;
    }
    const NullSpace null = find_null_space(matrix(), 1e-12, Watch(cancel_));
    if (null.rank_loss == 0) {
      const bool was_met = largest_violation(input) <= model_.control.assembly_tolerance;
      return complied && !was_met ? met_elsewhere() : "";
    }
    return "these constraints follow from each other: " +
           joined(owners_of(model_, by_model_row(null.left), 6)) +
           "\n  hint: remove the redundant ones, or regularize a joint " + kRegularization;
  }

  /// Goes from the start to where the constraints are violated least, by Levenberg and Marquardt's
  /// method. False when it cannot begin.
  bool comply(int iterations) {
    double violated = violation();
    for (int k = 0; k < iterations && violated > 0; ++k) {
      const auto delta = is_cancelled() ? std::nullopt : least_squares_correction();
      if (!delta) return k > 0;
      const State before = state_;
      double now = HUGE_VAL;
      for (double step = 1; step > 1e-3 && !(now < violated); step /= 2) {
        state_ = before;
        apply(step * *delta);
        compute_residual();
        now = violation();
      }
      if (!(now < violated)) {
        state_ = before;
        compute_residual();
        return true;
      }
      const bool is_done = violated - now <= 1e-9 * violated;
      violated = now;
      if (is_done) return true;
    }
    return true;
  }

  double largest_violation(const std::vector<double>& r) const {
    double largest = 0;
    for (int a = node_rows_; a < size_; ++a) largest = std::max(largest, std::abs(r[rows_[a]]));
    return largest;
  }

  /// Of the constraints' position level, in the least-squares sense.
  double violation() const {
    double r2 = 0;
    for (int a = node_rows_; a < size_; ++a) r2 += r_[rows_[a]] * r_[rows_[a]];
    return std::isfinite(r2) ? std::sqrt(r2) : HUGE_VAL;
  }

  /// (CᵀC + μ1) δ = Cᵀr with the constraints' rows C of the position level.
  std::optional<VecX> least_squares_correction() {
    std::vector<Eigen::Triplet<double>> constraints;
    const Eigen::SparseMatrix<double> m = matrix();
    for (int column = 0; column < size_; ++column)
      for (Eigen::SparseMatrix<double>::InnerIterator entry(m, column); entry; ++entry)
        if (entry.row() >= node_rows_ && entry.row() < size_)
          constraints.emplace_back(entry.row() - node_rows_, column, entry.value());
    Eigen::SparseMatrix<double> c(size_ - node_rows_, size_), identity(size_, size_);
    c.setFromTriplets(constraints.begin(), constraints.end());
    identity.setIdentity();
    factors_.factor(c.transpose() * c + kDamping * identity, Watch(cancel_));
    if (!factors_.regular()) return std::nullopt;
    VecX r(size_ - node_rows_), delta = VecX::Zero(2 * size_);
    for (int a = node_rows_; a < size_; ++a) r(a - node_rows_) = r_[rows_[a]];
    delta.head(size_) = factors_.solve(c.transpose() * r);
    if (!delta.allFinite()) return std::nullopt;
    return delta;
  }

  /// The constraints that stay violated, of each element the largest violation, and what it is with
  /// the residual of the input.
  std::string contradictions(const std::vector<double>& input) const {
    if (!(largest_violation(r_) > kContradicted * largest_violation(input))) return {};
    return "these constraints contradict each other; the least violation that was found leaves" +
           violations(r_, &input) +
           "\n  hint: correct the positions or orientations given to one of them, or remove one";
  }

  /// Where the constraints agree; Newton's method does not get there from the input.
  std::string met_elsewhere() const {
    const auto moved = [&](const StructuralNode& node) -> Vec3 {
      return Vec3(state_.y.data() + node.first) - Vec3(start_.y.data() + node.first);
    };
    const StructuralNode* farthest = nullptr;
    for (const StructuralNode& node : model_.structural)
      if (!node.is_dummy() && (!farthest || moved(node).norm() > moved(*farthest).norm()))
        farthest = &node;
    const char* const hint =
        "\n  hint: give the nodes positions and orientations nearer to the assembled ones";
    constexpr double kMoved = 1e-9;
    if (!farthest || moved(*farthest).norm() < kMoved)
      return std::string("the constraints can be met with orientations far from the input") + hint;
    const Vec3 x(state_.y.data() + farthest->first);
    char text[120];
    std::snprintf(text, sizeof text, " would be at (%.3g, %.3g, %.3g), %.3g away from its input",
                  x(0), x(1), x(2), moved(*farthest).norm());
    return "the constraints can be met far from the input: " +
           model_.row_text(farthest->equilibrium).first + text + hint;
  }

  /// When the input contradicts nothing else.
  std::string contradicted_velocities() const {
    char text[32];
    std::snprintf(text, sizeof text, "%.3g", velocity_error());
    return "the input contradicts prescribed velocities alone" + violations(r_rate_) +
           "\n  hint: give the nodes these velocities, or a `derivatives tolerance` larger than " +
           text + " to leave them to the first step";
  }

  /// Each element whose rows in `r` (n) are of the order of the largest, with the worst of them,
  /// and what it is in `input`, which counts, too.
  std::string violations(const std::vector<double>& r,
                         const std::vector<double>* input = nullptr) const {
    const auto size = [&](const std::vector<double>& of, int a) { return std::abs(of[rows_[a]]); };
    const auto both = [&](int a) { return size(r, a) + (input ? size(*input, a) : 0); };
    const double largest = largest_violation(r);
    std::map<std::string, int> worst;  // local row by owner
    for (int a = node_rows_; a < size_; ++a) {
      if (size(r, a) < 1e-2 * largest) continue;
      const auto [known, added] = worst.try_emplace(model_.row_text(rows_[a]).first, a);
      if (!added && both(a) >= both(known->second)) known->second = a;
    }
    std::string s;
    for (const auto& [owner, a] : worst) {
      char text[64];
      std::snprintf(text, sizeof text, ": off by %.3g", size(r, a));
      s += "\n  " + owner + ", " + model_.row_text(rows_[a]).second + text;
      if (!input) continue;
      std::snprintf(text, sizeof text, ", in the input by %.3g", size(*input, a));
      s += text;
    }
    return s;
  }

  VecX by_model_row(const VecX& local) const {
    VecX r = VecX::Zero(n_);
    for (int a = 0; a < size_; ++a)
      r(rows_[a]) = std::max(std::abs(local(a)), std::abs(local(size_ + a)));
    return r;
  }

  static constexpr double kDamping = 1e-6;       ///< µ
  static constexpr double kContradicted = 1e-3;  ///< part of the input's violation that stays

  const Model& model_;
  State& state_;
  const State start_;
  const CancelToken* const cancel_;
  const Interruption interruption_;
  SparseFactors factors_;
  const std::unique_ptr<Scratch> scratch_;  ///< of elements
  int n_;
  int size_ = 0, node_rows_ = 0;  ///< local rows of one level, those of nodes among them
  std::vector<ElementRef> elements_;
  std::vector<int> rows_, columns_;     ///< local index -> model row, column
  std::vector<bool> is_velocity_;       ///< local index: of a velocity alone
  std::vector<int> to_local_, row_of_;  ///< model column, row (rate level: + n) -> local index
  std::vector<double> r_, r_rate_;      ///< by model row (n)
  std::vector<double> errors_;          ///< by iterations
};

}  // namespace

Result<AssemblyReport> assemble_initially(const Model& model, State& state,
                                          const CancelToken* cancel) {
  if (model.control.skip_assembly) return AssemblyReport{};
  const State input = state;
  Assembly assembly(model, state, cancel);
  if (!assembly.needed()) return AssemblyReport{};
  auto report = assembly.run();
  if (!report || !report->moved) {
    state = input;  // untouched to the last bit
    return report;
  }
  state.rotation_history =
      std::vector<NodeRotationHistory>(state.rotation.begin(), state.rotation.end());
  for (const StructuralNode& node : model.structural)
    if (node.has_rotation())
      for (int i = 0; i < 3; ++i) state.y[node.first + 3 + i] = 0;
  Scratch scratch(model.scratch);
  EvalContext context = model.context(state, Phase::assembly);
  context.scratch = &scratch;
  for (const ElementRef& e : model.elements) e.set->after_assembly(context, state, e.index);
  return report;
}

}  // namespace mbcosim
