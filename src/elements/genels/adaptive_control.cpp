#include "elements/genels/adaptive_control.h"

namespace mbcosim {

void AdaptiveControl::connect(GeneralConnection& c) {
  SampledControl::connect(c);
  fresh_ = c.memory(1);
  identifier_.connect(c, 0);
}

void AdaptiveControl::start(const GeneralView& u, State& state) const {
  excite(u, &state.memory[u.memory_offset()]);
}

void AdaptiveControl::after_predict(const GeneralView& u, State& state) const {
  double* memory = &state.memory[u.memory_offset()];
  if (memory[fresh_] == 0) return;
  memory[fresh_] = 0;
  excite(u, memory);
}

void AdaptiveControl::excite(const GeneralView& u, double* memory) const {
  for (std::size_t k = 0; k < settings_.excitation.size(); ++k)
    control(memory)[k] = u.drive(settings_.excitation[k]);
}

void AdaptiveControl::take(const double* y, const double* u, double* memory) const {
  identifier_.update(memory, y, u);
  memory[fresh_] = 1;
}

std::vector<std::string> AdaptiveControl::private_data() const {
  std::vector<std::string> names = SampledControl::private_data();
  for (int k = 1; k < identifier_.count(); ++k) names.push_back("theta[" + std::to_string(k) + "]");
  names.push_back("forgetting");
  return names;
}

double AdaptiveControl::private_value(const GeneralView& u, int datum) const {
  if (datum < input_count()) return SampledControl::private_value(u, datum);
  return u.memory(identifier_.first() + datum - input_count());
}

bool AdaptiveControl::sampled_table(SampledTable& table) const {
  if (settings_.file.empty()) return false;
  table = {settings_.file, identifier_.samples(), identifier_.first(), identifier_.count()};
  return true;
}

}  // namespace mbcosim
