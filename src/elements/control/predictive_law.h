/// Controls from predictions of an identified model: generalized predictive and deadbeat control.
#pragma once

#include <vector>

#include "elements/control/arx_identifier.h"

namespace mbcosim {

/// After sample k the controls u_{k+1} … u_{k+nu} are those that make
///
///   J = Σ_{j=n1+1…n2} W_j |y_{k+j} − r|² + w Σ_{i=1…nu} R_i |δ_i|²
///
/// least, with y predicted by the identified model without future noise; u_{k+1} is applied, and
/// the next sample asks anew (D. W. Clarke, C. Mohtadi, P. S. Tuffs, "Generalized predictive
/// control", Automatica 23, 1987). Among equals those nearest to what was planned are taken.
/// Where the model tells nothing (before anything is identified) δ is zero.
///
/// Without a period, δ_i = u_{k+i}, what other elements add is not foreseen, and the last control
/// is held beyond nu. With a period of N samples, δ_i = u_{k+i} − u_{k+i−N}, zero beyond nu, and
/// what disturbs the outputs and inputs is foreseen to repeat itself: y and u enter the prediction
/// by their differences over N samples. N = 1 gives integral action (Clarke's CARIMA model).
///
/// Deadbeat control is the case n1 = nu − 1, W = 1, w = 0: with the exact model of order p,
/// nu > p, n2 ≥ nu + p and N ≤ 1 the outputs are at r from the nu-th sample on (as many inputs as
/// outputs).
class PredictiveLaw {
 public:
  struct Settings {
    int n2 = 1;             ///< prediction advancing horizon
    int nu = 1;             ///< control advancing horizon, ≤ n2
    int n1 = 0;             ///< prediction receding horizon, < n2
    std::vector<double> W;  ///< (n2 − n1)
    std::vector<double> R;  ///< (nu)
    int period = 0;         ///< N
  };
  static Settings deadbeat(int n2, int nu, int period);

  explicit PredictiveLaw(Settings settings) : settings_(std::move(settings)) {}

  /// Samples that the histories need beyond the model's own.
  int extra_samples() const { return settings_.period; }
  void connect(GeneralConnection& c, const ArxModel& model);
  /// Controls `u` of the next sample for the desired outputs `r` and the weight w.
  void control(const ArxIdentifier& identifier, const double* r, double weight, double* memory,
               double* scratch, double* u) const;
  /// No control is asked for: the law's own are zero.
  void rest(double* memory) const;

 private:
  struct View;
  void predict_free(const View& v) const;
  void predict_response(const View& v, int i, int input) const;
  double shape(int i, int j) const;
  void normal_equations(const View& v, const double* r, double weight) const;
  void shift_plan(double* memory) const;
  void solve(const View& v) const;
  int unknowns() const { return settings_.nu * model_.inputs; }

  Settings settings_;
  ArxModel model_;
  /// Offsets in the element's scratch.
  int free_ = 0;      ///< y_{k+1} … y_{k+n2} with δ = 0
  int response_ = 0;  ///< for each unknown δ: its share in y_{k+1} … y_{k+n2}
  int matrix_ = 0;    ///< above and on the diagonal the normal matrix, below its factor
  int pivots_ = 0, right_ = 0, residual_ = 0;
  /// Offsets in the element's memory.
  int delta_ = 0;  ///< the plan: δ_1 … δ_nu
  int own_ = 0;    ///< the law's controls of the last N samples, latest first
};

}  // namespace mbcosim
