/// Linear systems between scalar degrees of freedom: `state space SISO`, `state space MIMO`,
/// `scalar filter`.
#pragma once

#include <vector>

#include "elements/general_element.h"
#include "elements/scalar_value.h"

namespace mbcosim {

/// E ẋ = A x + B u,  y = C x + D u.
struct LinearSystem {
  MatX A;  ///< n × n
  MatX B;  ///< n × inputs
  MatX C;  ///< outputs × n
  MatX D;  ///< outputs × inputs; may be empty
  MatX E;  ///< n × n; empty: identity

  int order() const { return static_cast<int>(A.rows()); }
  int outputs() const { return static_cast<int>(C.rows()); }
  int inputs() const { return static_cast<int>(B.cols()); }
};

/// Rescales the states by powers of 2 so that rows and columns of A have similar norms (Parlett and
/// Reinsch, "Balancing a matrix for calculation of eigenvalues and eigenvectors", Numer. Math. 13,
/// 1969; norms as in LAPACK's dgebal). With E states and equations are rescaled by powers of 10:
/// pencil_scaling.h.
void balance(LinearSystem& system);

/// Companion form of k (n₀ s^m + … + n_m)/(s^n + d₁ s^(n−1) + … + d_n), m ≤ n.
enum class CanonicalForm { controllable, observable };
LinearSystem companion_system(CanonicalForm form, const std::vector<double>& denominator,
                              const std::vector<double>& numerator);

/// Rows of the states: B u + A x − E ẋ; of each output dof: C x + D u − y.
class LinearSystemElement : public GeneralElement {
 public:
  LinearSystemElement(LinearSystem system, std::vector<NodeDof> outputs,
                      std::vector<ScalarValue> inputs)
      : system_(std::move(system)), outputs_(std::move(outputs)), inputs_(std::move(inputs)) {}
  /// Start values of the states and their rates; empty: zero.
  void set_start(VecX x, VecX xp) {
    x0_ = std::move(x);
    xp0_ = std::move(xp);
  }

  void connect(GeneralConnection& c) override;
  void residual(const GeneralView& u, GeneralResidual& r) const override;
  void jacobian(const GeneralView& u, GeneralJacobian& j) const override;
  void start(const GeneralView& u, State& state) const override;
  std::string row_name(int own) const override { return "state " + std::to_string(own + 1); }
  void output(const GeneralView& u, OutputRow& row) const override;
  int private_datum(std::string_view name) const override;
  std::vector<Datum> private_data() const override;
  double private_value(const GeneralView& u, int datum) const override;

 private:
  double input(const GeneralView& u, int k) const;
  LinearSystem system_;
  std::vector<NodeDof> outputs_;
  std::vector<ScalarValue> inputs_;
  VecX x0_, xp0_;
  int first_state_ = 0;              ///< local number
  std::vector<int> output_, input_;  ///< local numbers; −1 for drives
};

}  // namespace mbcosim
