/// `electric: …, discrete control, …, control`: a discrete linear controller with given gains.
/// MBDyn input manual, "Discrete control".
#pragma once

#include <vector>

#include "elements/control/sampled_control.h"

namespace mbcosim {

/// u_c,k = Σ_{j=1…q} A_j y_{k−j} + Σ_{i=1…p} B_i u_{k−i}.
class DiscreteControl : public SampledControl {
 public:
  /// A: q matrices (inputs × outputs); B: p matrices (inputs × inputs).
  struct Gains {
    std::vector<MatX> A, B;
  };

  DiscreteControl(Gains gains, Signals signals)
      : SampledControl(std::move(signals)), gains_(std::move(gains)) {}

  void connect(GeneralConnection& c) override;
  /// Only now: till the end of the step before, u_c is what that step had.
  void after_predict(const GeneralView& u, State& state) const override;

 private:
  void add_sample(const double* y, const double* u, double* memory) const override;

  Gains gains_;
  int y_ = 0, u_ = 0;  ///< offsets in the element's memory: y and u of the last samples
};

}  // namespace mbcosim
