#include "elements/control/discrete_control.h"

namespace mbcosim {

void DiscreteControl::connect(GeneralConnection& c) {
  SampledControl::connect(c);
  y_ = c.memory(static_cast<int>(gains_.A.size()) * output_count());
  u_ = c.memory(static_cast<int>(gains_.B.size()) * input_count());
}

void DiscreteControl::add_sample(const double* y, const double* u, double* memory) const {
  push_sample(memory + y_, static_cast<int>(gains_.A.size()), output_count(), y);
  push_sample(memory + u_, static_cast<int>(gains_.B.size()), input_count(), u);
}

void DiscreteControl::after_predict(const GeneralView& u, State& state) const {
  double* memory = &state.memory[u.memory_offset()];
  Eigen::Map<VecX> sum(control(memory), input_count());
  sum.setZero();
  for (std::size_t j = 0; j < gains_.A.size(); ++j)
    sum.noalias() +=
        gains_.A[j] * Eigen::Map<const VecX>(memory + y_ + j * output_count(), output_count());
  for (std::size_t i = 0; i < gains_.B.size(); ++i)
    sum.noalias() +=
        gains_.B[i] * Eigen::Map<const VecX>(memory + u_ + i * input_count(), input_count());
}

}  // namespace mbcosim
