#include "solver/third_order.h"

#include <algorithm>
#include <cmath>

#include "solver/doubled_pattern.h"
#include "solver/system.h"

namespace mbcosim {

ThirdOrderFormula ThirdOrderFormula::tunable(double rho) {
  const double t = -rho / (1 + rho), s = 1 + t, q = t * t * (3 + 2 * t);
  if (t == 0)
    throw EvaluationError(
        "method: third order with a spectral radius of zero is not defined; use `third order, ad "
        "hoc`");
  return {
      t,        (1 + 3 * t) / (6 * t), -1 / (6 * t * s), (2 + 3 * t) / (6 * s), 1 - q, q, t * s * s,
      t * t * s};
}

ThirdOrderFormula ThirdOrderFormula::ad_hoc() {
  const double t = -2.0 / 3;
  return {t, (2 * t + 1) / (2 * t), -1 / (2 * t), 0, 1 - t * t, t * t, t * (1 + t), 0};
}

TwoStageSystem::TwoStageSystem(const Model& model, Workspace& workspace)
    : model_(model),
      ws_(workspace),
      n_(model.unknowns),
      pattern_(doubled_pattern(model.column_start, model.row_index)),
      scratch_(2 * n_, pattern_.row_index.size()),
      solver_(doubled_solver(model, {model.column_start, model.row_index})),
      stage_residual_(n_),
      by_rate_(model.row_index.size()),
      by_value_(model.row_index.size()) {}

void TwoStageSystem::choose_pivots(const State& state, const ThirdOrderFormula& f) {
  f_ = f;
  stage_ = state;
  stage_.h = model_.initial_value.time_step;
  end_ = &stage_;
  compute_matrix();
  solver_.analyze(scratch_.values.data());
}

void TwoStageSystem::start(State& state, const ThirdOrderFormula& f) {
  f_ = f;
  end_ = &state;
  predict_stage();
}

/// ẏ_ξ = ẏ₁, y_ξ = y + θ h ẏ₁; rotations relative to the reference of the end: g_ξ = θ h ω₁, ġ_ξ =
/// 0.
void TwoStageSystem::predict_stage() {
  const State& state = *end_;
  stage_ = state;
  const double step = f_.theta * state.h;
  stage_.time += step;
  for (int i = 0; i < n_; ++i) {
    const bool differential = is_differential(i);
    (differential ? stage_.y : stage_.yp)[i] += step * (differential ? state.yp1 : state.y1)[i];
  }
  for (std::size_t k = 0; k < model_.structural.size(); ++k) {
    const StructuralNode& node = model_.structural[k];
    if (!node.has_rotation()) continue;
    for (int i = 0; i < 3; ++i) {
      stage_.y[node.first + 3 + i] = step * state.rotation_history[k].w1(i);
      stage_.yp[node.first + 3 + i] = 0;
    }
  }
  update_rotations(model_, stage_);
}

void TwoStageSystem::compute_residual() {
  stage_.external_loads = end_->external_loads;  // which the exchange may have changed
  stage_.memory = end_->memory;
  Evaluators* const evaluators = ws_.evaluators.get();
  mbcosim::compute_residual(model_.context(*end_, Phase::step), ws_.scratch, ws_.residual,
                            evaluators);
  mbcosim::compute_residual(model_.context(stage_, Phase::step), ws_.scratch, stage_residual_,
                            evaluators);
  std::copy(ws_.residual.begin(), ws_.residual.end(), scratch_.residual.begin());
  std::copy(stage_residual_.begin(), stage_residual_.end(), scratch_.residual.begin() + n_);
}

double TwoStageSystem::error(const NewtonSettings& settings) const {
  const double a = residual_error(model_, settings, *end_, ws_.residual),
               b = residual_error(model_, settings, stage_, stage_residual_);
  return settings.residual_test == ResidualTest::norm ? std::hypot(a, b)
         : !(a > b) && !std::isnan(a)                 ? b
                                                      : a;
}

bool TwoStageSystem::exceeds_limits(const NewtonSettings& settings) const {
  return exceeds_residual_limits(model_, settings, ws_.residual) ||
         exceeds_residual_limits(model_, settings, stage_residual_);
}

/// by_rate_ and by_value_ at `state`, from the Jacobians with two values of ∂y/∂δ: it is linear in
/// it.
void TwoStageSystem::split(const State& state) {
  EvalContext context = model_.context(state, Phase::step);
  context.seed = 0;
  compute_jacobian(context, ws_);
  std::swap(by_rate_, ws_.values);
  context.seed = state.h;
  compute_jacobian(context, ws_);
  for (std::size_t k = 0; k < by_value_.size(); ++k)
    by_value_[k] = (ws_.values[k] - by_rate_[k]) / state.h;
}

/// Rows of one half (0: end, 1: stage): diagonal block by_rate_ + own h by_value_, other block
/// other h by_value_.
void TwoStageSystem::fill(int half, double own, double other) {
  const std::size_t all = model_.row_index.size();
  for (int block = 0; block < 2; ++block) {
    const double factor = end_->h * (block == half ? own : other);
    for (int j = 0; j < n_; ++j) {
      const int first = model_.column_start[j], last = model_.column_start[j + 1];
      double* out = &scratch_.values[2 * (block * all + first) + (half == 1 ? last - first : 0)];
      for (int k = first; k < last; ++k)
        *out++ = (block == half ? by_rate_[k] : 0.0) + factor * by_value_[k];
    }
  }
}

void TwoStageSystem::compute_matrix() {
  split(*end_);
  fill(0, f_.w0, f_.w1);
  split(stage_);
  fill(1, f_.p0 * f_.w1, f_.p0 * f_.w0 + f_.q0);
}

/// The matrix in the pattern of the tangents, and with them: the loads in both halves of the rows
/// follow the motion at the end of the step, y = … + h (w0 δ + w1 δ_ξ), ẏ = … + δ.
void TwoStageSystem::add_tangents() {
  const TangentSolver& tangents = *ws_.tangents;
  const SparsePattern& wide = tangents.pattern();
  if (!tangent_solver_) tangent_solver_.reset(new LinearSolver(doubled_solver(model_, wide)));
  tangent_solver_->set_watch(watch_);
  EvalContext context = model_.context(*end_, Phase::step);
  const auto loads = [&](double seed, std::vector<double>& values) {
    context.seed = seed;
    compute_seeds(context, ws_.seeds);
    values.assign(wide.row_index.size(), 0.0);
    tangents.add(seed, ws_.seeds, values);
  };
  const double h = end_->h;
  loads(0, load_by_rate_);
  loads(h, load_by_value_);
  for (std::size_t k = 0; k < load_by_rate_.size(); ++k)
    load_by_value_[k] = (load_by_value_[k] - load_by_rate_[k]) / h;

  tangent_values_.assign(4 * wide.row_index.size(), 0.0);
  const std::vector<int>& own = tangents.own();
  for (int block = 0; block < 2; ++block)
    for (int j = 0; j < n_; ++j)
      for (int half = 0; half < 2; ++half) {
        const int first = model_.column_start[j], last = model_.column_start[j + 1];
        const int wide_first = wide.column_start[j], size = wide.column_start[j + 1] - wide_first;
        const double* in =
            &scratch_.values[2 * (block * model_.row_index.size() + first) + half * (last - first)];
        double* out =
            &tangent_values_[2 * (block * wide.row_index.size() + wide_first) + half * size];
        for (int k = first; k < last; ++k) out[own[k] - wide_first] = *in++;
        for (int k = 0; k < size; ++k)
          out[k] += (block == 0 ? load_by_rate_[wide_first + k] : 0.0) +
                    h * (block == 0 ? f_.w0 : f_.w1) * load_by_value_[wide_first + k];
      }
}

void TwoStageSystem::set_watch(const Watch& watch) {
  watch_ = watch;
  solver_.set_watch(watch);
}

std::size_t TwoStageSystem::bytes() const {
  return solver_.bytes() + (tangent_solver_ ? tangent_solver_->bytes() : 0);
}

bool TwoStageSystem::factor() {
  if (!ws_.tangents) return solver_.factor(scratch_.values.data()) == LinearSolver::Outcome::ok;
  add_tangents();
  return tangent_solver_->factor_alone(tangent_values_.data()) == LinearSolver::Outcome::ok;
}

void TwoStageSystem::solve(double* rhs) { (ws_.tangents ? *tangent_solver_ : solver_).solve(rhs); }

int TwoStageSystem::singular_column() const {
  const int column = (ws_.tangents ? *tangent_solver_ : solver_).singular_column();
  return column < 0 ? -1 : column % n_;
}

double TwoStageSystem::gradient(int i) const {
  double g = 0;
  for (int k = pattern_.column_start[i]; k < pattern_.column_start[i + 1]; ++k)
    g += scratch_.values[k] * scratch_.residual[pattern_.row_index[k]];
  return g;
}

void TwoStageSystem::correct(const std::vector<double>& delta) {
  State& state = *end_;
  const double h = state.h;
  for (int i = 0; i < n_; ++i) {
    const double d = delta[i], s = delta[n_ + i];
    const double value = h * (f_.w1 * s + f_.w0 * d),
                 stage_value = h * (f_.p0 * f_.w1 * s + (f_.p0 * f_.w0 + f_.q0) * d);
    const bool differential = is_differential(i);
    (differential ? state.yp : state.y)[i] += d;
    (differential ? stage_.yp : stage_.y)[i] += s;
    (differential ? state.y : state.yp)[i] += value;
    (differential ? stage_.y : stage_.yp)[i] += stage_value;
  }
  update_rotations(model_, state);
  update_rotations(model_, stage_);
}

void TwoStageSystem::mark() {
  ws_.start = *end_;
  marked_stage_ = stage_;
}

void TwoStageSystem::go_back() {
  *end_ = ws_.start;
  stage_ = marked_stage_;
}

bool TwoStageSystem::is_differential(int i) const {
  return model_.kinds[i % n_] == UnknownKind::differential;
}

double TwoStageSystem::magnitude(int i) const {
  const State& state = i < n_ ? *end_ : stage_;
  return std::max({std::abs(state.y[i % n_]), std::abs(state.yp[i % n_]), 1.0});
}

double TwoStageSystem::square() const {
  double sum = 0;
  for (const State* state : {static_cast<const State*>(end_), &stage_})
    for (const std::vector<double>* v : {&state->y, &state->yp})
      for (const double x : *v) sum += x * x;
  return sum;
}

}  // namespace mbcosim
