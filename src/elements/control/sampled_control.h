/// What the kinds of `electric: …, discrete control` have in common. MBDyn input manual, "Discrete
/// control".
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "elements/general_element.h"
#include "elements/scalar_value.h"

namespace mbcosim {

/// Shifts a history of `samples` vectors (latest first) by one and puts `latest` first.
void push_sample(double* history, int samples, int width, const double* latest);

/// Adds controls u_c to the equations of the controlled dofs ("inputs" of the process) and holds
/// them from one sample to the next. Samples of the measures y ("outputs" of the process: dofs or
/// drives, scaled) and of the values u of the controlled dofs are taken at every `period`-th
/// solution, the initial one counted as the first; before them all is zero. u has what other
/// elements add to these equations, too.
class SampledControl : public GeneralElement {
 public:
  struct Measure {
    ScalarValue value;
    DrivePtr scale;  ///< null: 1
  };
  struct Signals {
    int period = 1;
    std::vector<Measure> outputs;
    std::vector<NodeDof> inputs;
  };

  explicit SampledControl(Signals signals) : signals_(std::move(signals)) {}

  void connect(GeneralConnection& c) override;
  /// u_c does not depend on the step being solved.
  void pattern(GeneralPattern&) const override {}
  void residual(const GeneralView& u, GeneralResidual& r) const override;
  void jacobian(const GeneralView&, GeneralJacobian&) const override {}
  void after_convergence(const GeneralView& u, State& state) const override;
  /// u[1], u[2], …: u_c of the present step.
  int private_datum(std::string_view name) const override;
  std::vector<Datum> private_data() const override;
  double private_value(const GeneralView& u, int datum) const override {
    return u.memory(control_ + datum);
  }

 protected:
  /// A sample has been taken. `memory`: the element's in State::memory.
  virtual void add_sample(const double* y, const double* u, double* memory) const = 0;

  /// k − 1 for "<start>k]" with k from 1 to `count`, else −1.
  static int component_in(std::string_view name, std::string_view start, int count);
  int output_count() const { return static_cast<int>(signals_.outputs.size()); }
  int input_count() const { return static_cast<int>(signals_.inputs.size()); }
  double* control(double* memory) const { return memory + control_; }

 private:
  Signals signals_;
  std::vector<int> row_;  ///< local rows of the inputs
  /// Offsets in the element's memory: solutions since the last sample, u_c, the last sample (y, u).
  int count_ = 0, control_ = 0, sample_ = 0;
};

}  // namespace mbcosim
