/// `electric: …, discrete control`: a discrete linear controller. MBDyn input manual, "Discrete
/// control".
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "elements/genels/state_space.h"

namespace mbcosim {

/// With the measures y ("outputs" of the process: dofs or drives, scaled) and the values u of the
/// controlled dofs ("inputs" of the process), sampled at accepted steps,
///
///   u_c,k = Σ_{j=1…q} A_j y_{k−j} + Σ_{i=1…p} B_i u_{k−i}
///
/// is added to the equations of the controlled dofs and held from one sample to the next. u has
/// what other elements add to these equations, too. Samples are taken at every `period`-th
/// solution, the initial one counted as the first; before them all is zero.
class DiscreteControl : public GeneralElement {
 public:
  struct Measure {
    ScalarValue value;
    DrivePtr scale;  ///< null: 1
  };
  /// A: q matrices (inputs × outputs); B: p matrices (inputs × inputs).
  struct Gains {
    std::vector<MatX> A, B;
  };

  DiscreteControl(Gains gains, int period, std::vector<Measure> outputs,
                  std::vector<NodeDof> inputs)
      : gains_(std::move(gains)),
        period_(period),
        outputs_(std::move(outputs)),
        inputs_(std::move(inputs)) {}

  void connect(GeneralConnection& c) override;
  /// u_c does not depend on the step being solved.
  void pattern(GeneralPattern&) const override {}
  void residual(const GeneralView& u, GeneralResidual& r) const override;
  void jacobian(const GeneralView&, GeneralJacobian&) const override {}
  void after_convergence(const GeneralView& u, State& state) const override;
  /// u[1], u[2], …: u_c.
  int private_datum(std::string_view name) const override;
  std::vector<std::string> private_data() const override;
  double private_value(const GeneralView& u, int datum) const override {
    return u.memory(control_ + datum);
  }

 private:
  int output_count() const { return static_cast<int>(outputs_.size()); }
  int input_count() const { return static_cast<int>(inputs_.size()); }
  void sample(const GeneralView& u, double* memory) const;
  void update(double* memory) const;

  Gains gains_;
  int period_;
  std::vector<Measure> outputs_;
  std::vector<NodeDof> inputs_;
  std::vector<int> row_;  ///< local rows of the inputs
  /// Offsets in the element's memory: solutions since the last sample, u_c, y and u of the last
  /// samples, latest first.
  int count_ = 0, control_ = 0, y_ = 0, u_ = 0;
};

}  // namespace mbcosim
