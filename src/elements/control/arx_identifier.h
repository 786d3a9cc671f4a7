/// Recursive identification of linear models from samples.
#pragma once

#include <vector>

#include "elements/general_element.h"

namespace mbcosim {

/// y_k = Σ_{i=1…p} A_i y_{k−i} + Σ_{i=0…q} B_i u_{k−i} + Σ_{i=1…p} C_i e_{k−i} + e_k, the C only of
/// an ARMAX model. Row o of the coefficients: row o of A_1 … A_p, B_0 … B_q, C_1 … C_p.
struct ArxModel {
  int outputs = 1, inputs = 1;
  int order_a = 1, order_b = 1;  ///< p, q
  bool noise = false;            ///< ARMAX

  int noise_order() const { return noise ? order_a : 0; }
  /// Coefficients of one output.
  int regressors() const { return (order_a + noise_order()) * outputs + (order_b + 1) * inputs; }
  /// Places in a row of the coefficients.
  int a(int i, int output) const { return (i - 1) * outputs + output; }
  int b(int i, int input) const { return order_a * outputs + i * inputs + input; }
  int c(int i, int output) const { return b(order_b + 1, 0) + (i - 1) * outputs + output; }
};

/// How much a new sample counts against the old ones.
///
/// Constant: what is known loses the factor d at each sample (exponential forgetting; L. Ljung,
/// "System Identification", 2nd ed., section 11.2). The estimate's covariance never grows beyond
/// its start, so that a process at rest is not forgotten altogether.
///
/// Dynamic: the new sample counts 1/λ_k as much as one with λ = 1. With s² the sum over the outputs
/// of the variance of the prediction errors in a window of the last samples,
///
///   λ_k = kref                               when |s²_n1 − s²_n2| > fact s²_n1, and else
///   λ_k = ρ λ_{k−1} + (1 − ρ) klim,          λ_{−1} = kref.
struct Forgetting {
  bool dynamic = false;
  double constant = 1;                    ///< d
  int long_window = 1, short_window = 1;  ///< n1 ≥ n2
  double rho = 0, fact = 1, reference = 1, limit = 1;
};

/// Recursive least squares, extended (by the prediction errors) for ARMAX models, with the
/// covariance as U D Uᵀ (G. J. Bierman, "Factorization Methods for Discrete Sequential Estimation",
/// 1977), which stays positive. All that changes is in the element's memory.
class ArxIdentifier {
 public:
  static constexpr double kStart = 1e12;  ///< variance of unknown coefficients

  ArxIdentifier(const ArxModel& model, const Forgetting& forgetting)
      : model_(model), forgetting_(forgetting) {}

  /// `extra`: samples kept beyond those that the model needs.
  void connect(GeneralConnection& c, int extra);
  void update(double* memory, const double* y, const double* u) const;

  const ArxModel& model() const { return model_; }
  /// Coefficients by rows (outputs × regressors), then λ.
  const double* coefficients(const double* memory) const { return memory + theta_; }
  int first() const { return theta_; }
  int count() const { return model_.outputs * model_.regressors() + 1; }
  int samples() const { return samples_; }  ///< offset of the number of samples so far
  /// Histories, latest first.
  const double* y(const double* memory, int i) const { return memory + y_ + i * model_.outputs; }
  const double* u(const double* memory, int i) const { return memory + u_ + i * model_.inputs; }
  const double* e(const double* memory, int i) const { return memory + e_ + i * model_.outputs; }

 private:
  void gather(double* memory) const;
  void predict(double* memory, const double* y) const;
  double forgetting_factor(double* memory) const;
  double variance(const double* memory, int window) const;
  void learn(double* memory, double weight) const;

  ArxModel model_;
  Forgetting forgetting_;
  int y_samples_ = 0, u_samples_ = 0, e_samples_ = 0;
  /// Offsets in the element's memory.
  int samples_ = 0, theta_ = 0, y_ = 0, u_ = 0, e_ = 0;
  int window_ = 0;                ///< the last n1 prediction errors
  int regressor_ = 0;             ///< φ
  int error_ = 0;                 ///< prediction error of the latest sample
  int d_ = 0, factor_ = 0;        ///< D; U's columns above the diagonal
  int projected_ = 0, gain_ = 0;  ///< Uᵀφ; P φ/(weight + φᵀP φ)
};

}  // namespace mbcosim
