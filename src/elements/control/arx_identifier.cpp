#include "elements/control/arx_identifier.h"

#include <algorithm>
#include <cmath>

#include "elements/control/sampled_control.h"

namespace mbcosim {

void ArxIdentifier::connect(GeneralConnection& c, int extra) {
  const int n = model_.regressors();
  y_samples_ = model_.order_a + extra;
  u_samples_ = model_.order_b + 1 + extra;
  e_samples_ = model_.noise ? y_samples_ : 0;
  samples_ = c.memory(1);
  theta_ = c.memory(model_.outputs * n);
  c.memory(1, forgetting_.dynamic ? forgetting_.reference : 1);  // λ, next to the coefficients
  y_ = c.memory(y_samples_ * model_.outputs);
  u_ = c.memory(u_samples_ * model_.inputs);
  e_ = c.memory(e_samples_ * model_.outputs);
  window_ = c.memory(forgetting_.dynamic ? forgetting_.long_window * model_.outputs : 0);
  regressor_ = c.memory(n);
  error_ = c.memory(model_.outputs);
  d_ = c.memory(n, kStart);
  factor_ = c.memory(n * (n - 1) / 2);
  projected_ = c.memory(n);
  gain_ = c.memory(n);
}

void ArxIdentifier::update(double* memory, const double* y, const double* u) const {
  push_sample(memory + u_, u_samples_, model_.inputs, u);
  gather(memory);
  predict(memory, y);
  const double factor = forgetting_factor(memory);
  memory[theta_ + count() - 1] = factor;
  learn(memory, factor);
  push_sample(memory + y_, y_samples_, model_.outputs, y);
  push_sample(memory + e_, e_samples_, model_.outputs, memory + error_);
  memory[samples_] += 1;
}

/// φ = (y_{k−1} … y_{k−p}, u_k … u_{k−q}, e_{k−1} … e_{k−p}); the histories end with k − 1, u's
/// with k.
void ArxIdentifier::gather(double* memory) const {
  double* next = memory + regressor_;
  next = std::copy_n(memory + y_, model_.order_a * model_.outputs, next);
  next = std::copy_n(memory + u_, (model_.order_b + 1) * model_.inputs, next);
  std::copy_n(memory + e_, model_.noise_order() * model_.outputs, next);
}

void ArxIdentifier::predict(double* memory, const double* y) const {
  const int n = model_.regressors();
  const Eigen::Map<const VecX> phi(memory + regressor_, n);
  for (int o = 0; o < model_.outputs; ++o)
    memory[error_ + o] = y[o] - Eigen::Map<const VecX>(memory + theta_ + o * n, n).dot(phi);
}

double ArxIdentifier::forgetting_factor(double* memory) const {
  if (!forgetting_.dynamic) return forgetting_.constant;
  push_sample(memory + window_, forgetting_.long_window, model_.outputs, memory + error_);
  const double whole = variance(memory, forgetting_.long_window),
               recent = variance(memory, forgetting_.short_window),
               last = memory[theta_ + count() - 1];
  if (std::abs(whole - recent) > forgetting_.fact * whole) return forgetting_.reference;
  return forgetting_.rho * last + (1 - forgetting_.rho) * forgetting_.limit;
}

/// Of the last prediction errors, summed over the outputs.
double ArxIdentifier::variance(const double* memory, int window) const {
  double sum = 0;
  for (int o = 0; o < model_.outputs; ++o) {
    const double* e = memory + window_ + o;
    double mean = 0, squares = 0;
    for (int k = 0; k < window; ++k) mean += e[k * model_.outputs] / window;
    for (int k = 0; k < window; ++k) {
      const double d = e[k * model_.outputs] - mean;
      squares += d * d;
    }
    sum += squares / window;
  }
  return sum;
}

/// Bierman's update of U and D by one sample of variance `weight`, then θ += e gainᵀ.
void ArxIdentifier::learn(double* memory, double weight) const {
  const int n = model_.regressors();
  const double* phi = memory + regressor_;
  double *d = memory + d_, *f = memory + projected_, *gain = memory + gain_;
  const double* column = memory + factor_;
  for (int j = 0; j < n; column += j, ++j) {
    f[j] = phi[j];
    for (int i = 0; i < j; ++i) f[j] += column[i] * phi[i];
  }
  double alpha = weight;
  double* factor = memory + factor_;
  for (int j = 0; j < n; factor += j, ++j) {
    const double before = alpha, v = d[j] * f[j], slope = -f[j] / before;
    alpha += f[j] * v;
    d[j] *= before / alpha;
    if (!forgetting_.dynamic) d[j] = std::min(d[j] / weight, kStart);
    gain[j] = v;
    for (int i = 0; i < j; ++i) {
      const double old = factor[i];
      factor[i] += slope * gain[i];
      gain[i] += old * v;
    }
  }
  for (int o = 0; o < model_.outputs; ++o) {
    const double step = memory[error_ + o] / alpha;
    for (int i = 0; i < n; ++i) memory[theta_ + o * n + i] += step * gain[i];
  }
}

}  // namespace mbcosim
