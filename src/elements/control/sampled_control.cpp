#include "elements/control/sampled_control.h"

#include <algorithm>
#include <charconv>

namespace mbcosim {

void push_sample(double* history, int samples, int width, const double* latest) {
  if (samples == 0) return;
  std::copy_backward(history, history + (samples - 1) * width, history + samples * width);
  std::copy_n(latest, width, history);
}

void SampledControl::connect(GeneralConnection& c) {
  for (const NodeDof& dof : signals_.inputs) row_.push_back(c.dof(dof));
  count_ = c.memory(1);
  control_ = c.memory(input_count());
  sample_ = c.memory(output_count() + input_count());
}

void SampledControl::residual(const GeneralView& u, GeneralResidual& r) const {
  for (int i = 0; i < input_count(); ++i) r.add(row_[i], u.memory(control_ + i));
}

void SampledControl::after_convergence(const GeneralView& u, State& state) const {
  double* memory = &state.memory[u.memory_offset()];
  memory[count_] += 1;
  if (memory[count_] < signals_.period) return;
  memory[count_] = 0;
  double* y = memory + sample_;
  double* inputs = y + output_count();
  for (int k = 0; k < output_count(); ++k) {
    const Measure& m = signals_.outputs[k];
    const double value = m.value.drive ? u.drive(m.value.drive) : u.dof(m.value.dof);
    y[k] = m.scale ? u.drive(m.scale) * value : value;
  }
  for (int k = 0; k < input_count(); ++k) inputs[k] = u.dof(signals_.inputs[k]);
  add_sample(y, inputs, memory);
}

int SampledControl::component_in(std::string_view name, std::string_view start, int count) {
  if (name.substr(0, start.size()) != start) return -1;
  int k = 0;
  const char *first = name.data() + start.size(), *end = name.data() + name.size();
  const auto [rest, error] = std::from_chars(first, end, k);
  if (error != std::errc() || *first == '0' || end - rest != 1 || *rest != ']') return -1;
  return k >= 1 && k <= count ? k - 1 : -1;
}

int SampledControl::private_datum(std::string_view name) const {
  return component_in(name, "u[", input_count());
}

std::vector<Datum> SampledControl::private_data() const {
  std::vector<Datum> data;
  for (int i = 1; i <= input_count(); ++i) data.push_back({"u[" + std::to_string(i) + "]", ""});
  return data;
}

}  // namespace mbcosim
