#include "elements/genels/discrete_control.h"

#include <algorithm>

namespace mbcosim {

void DiscreteControl::connect(GeneralConnection& c) {
  for (const NodeDof& dof : inputs_) row_.push_back(c.dof(dof));
  count_ = c.memory(1);
  control_ = c.memory(input_count());
  y_ = c.memory(static_cast<int>(gains_.A.size()) * output_count());
  u_ = c.memory(static_cast<int>(gains_.B.size()) * input_count());
}

void DiscreteControl::residual(const GeneralView& u, GeneralResidual& r) const {
  for (int i = 0; i < input_count(); ++i) r.add(row_[i], u.memory(control_ + i));
}

void DiscreteControl::after_convergence(const GeneralView& u, State& state) const {
  double* memory = &state.memory[u.memory_offset()];
  memory[count_] += 1;
  if (memory[count_] < period_) return;
  memory[count_] = 0;
  sample(u, memory);
  update(memory);
}

void DiscreteControl::sample(const GeneralView& u, double* memory) const {
  const auto make_room = [&](int first, std::size_t samples, int width) {
    double* begin = memory + first;
    std::copy_backward(begin, begin + (samples - 1) * width, begin + samples * width);
  };
  make_room(y_, gains_.A.size(), output_count());
  for (int k = 0; k < output_count(); ++k) {
    const Measure& m = outputs_[k];
    const double value = m.value.drive ? u.drive(m.value.drive) : u.dof(m.value.dof);
    memory[y_ + k] = m.scale ? u.drive(m.scale) * value : value;
  }
  if (gains_.B.empty()) return;
  make_room(u_, gains_.B.size(), input_count());
  for (int k = 0; k < input_count(); ++k) memory[u_ + k] = u.dof(inputs_[k]);
}

void DiscreteControl::update(double* memory) const {
  Eigen::Map<VecX> control(memory + control_, input_count());
  control.setZero();
  for (std::size_t j = 0; j < gains_.A.size(); ++j)
    control.noalias() +=
        gains_.A[j] * Eigen::Map<const VecX>(memory + y_ + j * output_count(), output_count());
  for (std::size_t i = 0; i < gains_.B.size(); ++i)
    control.noalias() +=
        gains_.B[i] * Eigen::Map<const VecX>(memory + u_ + i * input_count(), input_count());
}

int DiscreteControl::private_datum(std::string_view name) const {
  const std::vector<std::string> names = private_data();
  const auto found = std::find(names.begin(), names.end(), name);
  return found == names.end() ? -1 : static_cast<int>(found - names.begin());
}

std::vector<std::string> DiscreteControl::private_data() const {
  std::vector<std::string> names;
  for (int i = 1; i <= input_count(); ++i) names.push_back("u[" + std::to_string(i) + "]");
  return names;
}

}  // namespace mbcosim
