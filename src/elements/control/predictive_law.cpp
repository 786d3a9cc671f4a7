#include "elements/control/predictive_law.h"

#include <algorithm>
#include <cmath>

#include "elements/control/sampled_control.h"

namespace mbcosim {

/// The identified model, its histories and the law's numbers. Times count from sample k.
struct PredictiveLaw::View {
  const PredictiveLaw& law;
  const ArxIdentifier& id;
  double* memory;
  double* scratch;

  const double* row(int o) const { return id.coefficients(memory) + o * law.model_.regressors(); }
  double* free(int j) const { return scratch + law.free_ + (j - 1) * law.model_.outputs; }
  double* response(int unknown, int j) const {
    return scratch + law.response_ + (unknown * law.settings_.n2 + j - 1) * law.model_.outputs;
  }
  double& matrix(int i, int j) const { return scratch[law.matrix_ + i * law.unknowns() + j]; }
  /// Signals of the past and of the free prediction, as they enter it: with a period their
  /// differences.
  double y(int t, int o) const {
    const int n = law.settings_.period;
    return n == 0 ? plain_y(t, o) : plain_y(t, o) - plain_y(t - n, o);
  }
  double plain_y(int t, int o) const { return t > 0 ? free(t)[o] : id.y(memory, -t)[o]; }
  double u(int t, int input) const {
    if (t > 0) return 0;
    const int n = law.settings_.period;
    const double now = id.u(memory, -t)[input];
    return n == 0 ? now : now - id.u(memory, n - t)[input];
  }
  double e(int t, int o) const {
    if (t > 0) return 0;
    const int n = law.settings_.period;
    const double now = id.e(memory, -t)[o];
    return n == 0 ? now : now - id.e(memory, n - t)[o];
  }
};

PredictiveLaw::Settings PredictiveLaw::deadbeat(int n2, int nu, int period) {
  return {n2, nu, nu - 1, std::vector<double>(n2 - nu + 1, 1), std::vector<double>(nu, 0), period};
}

void PredictiveLaw::connect(GeneralConnection& c, const ArxModel& model) {
  model_ = model;
  const int n = unknowns();
  free_ = c.scratch(settings_.n2 * model.outputs);
  response_ = c.scratch(n * settings_.n2 * model.outputs);
  matrix_ = c.scratch(n * n);
  pivots_ = c.scratch(n);
  right_ = c.scratch(n);
  residual_ = c.scratch(n);
  delta_ = c.memory(n);
  own_ = c.memory(settings_.period * model.inputs);
}

void PredictiveLaw::control(const ArxIdentifier& identifier, const double* r, double weight,
                            double* memory, double* scratch, double* u) const {
  const View v{*this, identifier, memory, scratch};
  predict_free(v);
  for (int i = 1; i <= settings_.nu; ++i)
    for (int m = 0; m < model_.inputs; ++m) predict_response(v, i, m);
  normal_equations(v, r, weight);
  shift_plan(memory);
  solve(v);
  const int period = settings_.period;
  for (int m = 0; m < model_.inputs; ++m) {
    const double base = period == 0 ? 0 : memory[own_ + (period - 1) * model_.inputs + m];
    u[m] = base + memory[delta_ + m];
  }
  push_sample(memory + own_, period, model_.inputs, u);
}

void PredictiveLaw::rest(double* memory) const {
  double* delta = memory + delta_;
  std::fill_n(delta, unknowns(), 0.);
  push_sample(memory + own_, settings_.period, model_.inputs, delta);
}

void PredictiveLaw::predict_free(const View& v) const {
  for (int j = 1; j <= settings_.n2; ++j)
    for (int o = 0; o < model_.outputs; ++o) {
      const double* row = v.row(o);
      double sum = settings_.period == 0 ? 0 : v.plain_y(j - settings_.period, o);
      for (int i = 1; i <= model_.order_a; ++i)
        for (int k = 0; k < model_.outputs; ++k) sum += row[model_.a(i, k)] * v.y(j - i, k);
      for (int i = j; i <= model_.order_b; ++i)
        for (int k = 0; k < model_.inputs; ++k) sum += row[model_.b(i, k)] * v.u(j - i, k);
      for (int i = j; i <= model_.noise_order(); ++i)
        for (int k = 0; k < model_.outputs; ++k) sum += row[model_.c(i, k)] * v.e(j - i, k);
      v.free(j)[o] = sum;
    }
}

/// Share of δ_i in u_{k+j}.
double PredictiveLaw::shape(int i, int j) const {
  if (j < i) return 0;
  if (settings_.period > 0) return (j - i) % settings_.period == 0 ? 1 : 0;
  return j == i || i == settings_.nu ? 1 : 0;
}

void PredictiveLaw::predict_response(const View& v, int i, int input) const {
  const int unknown = (i - 1) * model_.inputs + input;
  for (int j = 1; j <= settings_.n2; ++j)
    for (int o = 0; o < model_.outputs; ++o) {
      const double* row = v.row(o);
      double sum = 0;
      for (int l = 1; l <= std::min(model_.order_a, j - 1); ++l)
        for (int k = 0; k < model_.outputs; ++k)
          sum += row[model_.a(l, k)] * v.response(unknown, j - l)[k];
      for (int l = 0; l <= std::min(model_.order_b, j - 1); ++l)
        sum += row[model_.b(l, input)] * shape(i, j - l);
      v.response(unknown, j)[o] = sum;
    }
}

void PredictiveLaw::normal_equations(const View& v, const double* r, double weight) const {
  const auto sum_over_outputs = [&](auto&& value) {
    double sum = 0;
    for (int j = settings_.n1 + 1; j <= settings_.n2; ++j)
      for (int o = 0; o < model_.outputs; ++o)
        sum += settings_.W[j - settings_.n1 - 1] * value(j, o);
    return sum;
  };
  for (int a = 0; a < unknowns(); ++a) {
    for (int b = a; b < unknowns(); ++b)
      v.matrix(a, b) =
          sum_over_outputs([&](int j, int o) { return v.response(a, j)[o] * v.response(b, j)[o]; });
    v.matrix(a, a) += weight * settings_.R[a / model_.inputs];
    v.scratch[right_ + a] =
        sum_over_outputs([&](int j, int o) { return v.response(a, j)[o] * (r[o] - v.free(j)[o]); });
  }
}

/// The plan of the last sample from its second controls on: its last control goes on.
void PredictiveLaw::shift_plan(double* memory) const {
  double* delta = memory + delta_;
  const int inputs = model_.inputs, rest = unknowns() - inputs;
  std::copy_n(delta + inputs, rest, delta);
  if (settings_.period > 0) std::fill_n(delta + rest, inputs, 0.);
}

/// H δ = b by (H + εI) (δ' − δ) = b − H δ, which tends to the solution nearest to the first δ where
/// H is singular.
void PredictiveLaw::solve(const View& v) const {
  const int n = unknowns();
  double *pivot = v.scratch + pivots_, *b = v.scratch + right_, *x = v.memory + delta_,
         *rest = v.scratch + residual_;
  double largest = 0;
  for (int i = 0; i < n; ++i) largest = std::max(largest, v.matrix(i, i));
  if (!(largest > 0) || !std::isfinite(largest)) {
    std::fill_n(x, n, 0.);
    return;
  }
  const double ridge = 1e-9 * largest;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j <= i; ++j) {
      double sum = v.matrix(j, i) + (i == j ? ridge : 0);
      for (int k = 0; k < j; ++k) sum -= v.matrix(i, k) * v.matrix(j, k);
      if (j < i)
        v.matrix(i, j) = sum / pivot[j];
      else
        pivot[i] = std::sqrt(std::max(sum, ridge));
    }
  constexpr int kPasses = 6;
  for (int pass = 0; pass < kPasses; ++pass) {
    for (int i = 0; i < n; ++i) {
      double sum = b[i];
      for (int j = 0; j < n; ++j) sum -= v.matrix(std::min(i, j), std::max(i, j)) * x[j];
      for (int j = 0; j < i; ++j) sum -= v.matrix(i, j) * rest[j];
      rest[i] = sum / pivot[i];
    }
    for (int i = n - 1; i >= 0; --i) {
      for (int j = i + 1; j < n; ++j) rest[i] -= v.matrix(j, i) * rest[j];
      rest[i] /= pivot[i];
    }
    for (int i = 0; i < n; ++i) x[i] += rest[i];
  }
}

}  // namespace mbcosim
