#include "elements/control/adaptive_control.h"

#include <algorithm>

namespace mbcosim {

void AdaptiveControl::connect(GeneralConnection& c) {
  SampledControl::connect(c);
  fresh_ = c.memory(1);
  identifier_.connect(c, law_ ? law_->extra_samples() : 0);
  if (!law_) return;
  desired_ = c.memory(output_count());
  law_->connect(c, settings_.model);
}

void AdaptiveControl::start(const GeneralView& u, State& state) const {
  double* memory = &state.memory[u.memory_offset()];
  std::fill_n(control(memory), input_count(), 0.);
  excite(u, memory);
}

void AdaptiveControl::after_predict(const GeneralView& u, State& state) const {
  double* memory = &state.memory[u.memory_offset()];
  if (memory[fresh_] == 0) return;
  memory[fresh_] = 0;
  std::fill_n(control(memory), input_count(), 0.);
  if (law_) obey_law(u, memory);
  excite(u, memory);
}

void AdaptiveControl::excite(const GeneralView& u, double* memory) const {
  for (std::size_t k = 0; k < settings_.excitation.size(); ++k)
    control(memory)[k] += u.drive(settings_.excitation[k]);
}

void AdaptiveControl::obey_law(const GeneralView& u, double* memory) const {
  if (settings_.trigger && u.drive(settings_.trigger) == 0) return law_->rest(memory);
  for (std::size_t k = 0; k < settings_.desired.size(); ++k)
    memory[desired_ + k] = u.drive(settings_.desired[k]);
  const double weight = settings_.control_weight ? u.drive(settings_.control_weight) : 0;
  if (weight < 0)
    throw EvaluationError("discrete control " + std::to_string(u.label()) +
                          ": the weight of the controls is negative");
  law_->control(identifier_, memory + desired_, weight, memory, u.scratch(), control(memory));
}

void AdaptiveControl::add_sample(const double* y, const double* u, double* memory) const {
  identifier_.update(memory, y, u);
  memory[fresh_] = 1;
}

int AdaptiveControl::private_datum(std::string_view name) const {
  if (const int k = SampledControl::private_datum(name); k >= 0) return k;
  const int last = identifier_.count() - 1;
  const int k = name == "forgetting" ? last : component_in(name, "theta[", last);
  return k < 0 ? -1 : input_count() + k;
}

std::vector<Datum> AdaptiveControl::private_data() const {
  std::vector<Datum> data = SampledControl::private_data();
  for (int k = 1; k < identifier_.count(); ++k)
    data.push_back({"theta[" + std::to_string(k) + "]", ""});
  data.push_back({"forgetting", ""});
  return data;
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
