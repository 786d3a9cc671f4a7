#include "solver/line_search.h"

#include <algorithm>
#include <cmath>

namespace mbcosim {

namespace {

double dot(const std::vector<double>& a, const std::vector<double>& b) {
  double s = 0;
  for (std::size_t i = 0; i < a.size(); ++i) s += a[i] * b[i];
  return s;
}

/// One trial along the direction: step fraction and ½ rᵀr there.
struct Trial {
  double lambda = 0, f = 0;
};

/// Minimum of the quadratic (first time) or cubic model of f along the direction.
double next_lambda(const LineSearchSettings& s, bool first, double f0, double slope,
                   const Trial& now, const Trial& before) {
  if (!s.cubic) return now.lambda * s.lambda_factor_min;
  double r;
  if (first) {
    r = -slope * now.lambda * now.lambda / (2 * (now.f - f0 - slope * now.lambda));
  } else {
    const double g1 = (now.f - f0 - now.lambda * slope) / (now.lambda * now.lambda);
    const double g2 = (before.f - f0 - before.lambda * slope) / (before.lambda * before.lambda);
    const double a = (g1 - g2) / (now.lambda - before.lambda);
    const double b = (-before.lambda * g1 + now.lambda * g2) / (now.lambda - before.lambda);
    const double disc = b * b - 3 * a * slope;
    if (a == 0)
      r = -slope / (2 * b);
    else if (disc < 0)
      r = 0.5 * now.lambda;
    else if (b <= 0)
      r = (-b + std::sqrt(disc)) / (3 * a);
    else
      r = -slope / (b + std::sqrt(disc));
  }
  if (!std::isfinite(r)) r = 0.5 * now.lambda;
  return std::max(std::min(r, 0.5 * now.lambda), s.lambda_factor_min * now.lambda);
}

/// Limits the length of δ: factor max(min scale, min(p/|δ|, 1)), p = max step · max(|(y, ẏ)|, n).
void limit_step(const LineSearchSettings& s, const NewtonSystem& system,
                std::vector<double>& delta) {
  const double size = std::sqrt(system.square());
  const double limit = s.max_step * std::max(size, static_cast<double>(delta.size()));
  const double norm = std::sqrt(dot(delta, delta));
  const double factor = std::max(s.min_scale, std::min(norm > 0 ? limit / norm : 1.0, 1.0));
  for (double& d : delta) d *= factor;
}

/// Is the gradient of ½ rᵀr so small that its minimum is a spurious one?
bool is_local_minimum(const LineSearchSettings& s, const NewtonSystem& system, int unknowns,
                      double f) {
  double largest = 0;
  for (int i = 0; i < unknowns; ++i)
    largest = std::max(largest, std::abs(system.gradient(i)) * system.magnitude(i));
  return largest < s.tolerance_min * std::max(f, 0.5 * unknowns);
}

/// The smallest step fraction for a correction.
double smallest_lambda(const LineSearchSettings& s, const NewtonSystem& system,
                       const std::vector<double>& delta) {
  if (!s.lambda_min_relative) return s.lambda_min;
  double t = 0;
  for (std::size_t i = 0; i < delta.size(); ++i)
    t = std::max(t, std::abs(delta[i]) / system.magnitude(static_cast<int>(i)));
  return std::max(s.lambda_min, std::min(t > 0 ? s.tolerance_x / t : 1.0, 1.0));
}

}  // namespace

bool search_along(NewtonSystem& system, const LineSearchSettings& s) {
  NewtonScratch& ws = system.scratch();
  system.mark();
  const double f0 = 0.5 * dot(ws.residual, ws.residual);
  if (s.scale_newton_step) limit_step(s, system, ws.delta);
  const double lambda_min = smallest_lambda(s, system, ws.delta);
  const double slope = -2 * f0;
  ws.direction = ws.delta;
  Trial now{1, 0}, before;
  for (int k = 0;; ++k) {
    for (std::size_t i = 0; i < ws.delta.size(); ++i) ws.delta[i] = now.lambda * ws.direction[i];
    system.go_back();
    system.correct(ws.delta);
    system.compute_residual();
    now.f = 0.5 * dot(ws.residual, ws.residual);
    if (std::isfinite(now.f) && now.f <= f0 + s.alpha * now.lambda * slope) return true;
    if (k >= s.max_iterations) return false;
    if (now.lambda <= lambda_min) {
      if (s.abort_at_lambda_min || !std::isfinite(now.f)) return false;
      if (!s.zero_gradient_continue &&
          is_local_minimum(s, system, static_cast<int>(ws.delta.size()), now.f))
        return false;
      return !s.divergence_check || now.f <= s.divergence_factor * f0;
    }
    const double next =
        std::isfinite(now.f) ? next_lambda(s, k == 0, f0, slope, now, before) : 0.5 * now.lambda;
    before = now;
    now.lambda = std::max(next, lambda_min);
  }
}

}  // namespace mbcosim
