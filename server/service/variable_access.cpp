#include "service/variable_access.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "wire/convert.h"
#include "wire/refusal.h"

namespace mbcosim::server {
namespace {

bool compare(v1::Comparison comparison, double value, double threshold) {
  switch (comparison) {
    case v1::COMPARISON_LESS:
      return value < threshold;
    case v1::COMPARISON_LESS_OR_EQUAL:
      return value <= threshold;
    case v1::COMPARISON_GREATER:
      return value > threshold;
    case v1::COMPARISON_GREATER_OR_EQUAL:
      return value >= threshold;
    default:
      return false;
  }
}

}  // namespace

void VariableAccess::check(int handle) const {
  if (handle >= 0 && handle < static_cast<int>(variables_.size())) return;
  throw Refusal(v1::REASON_NO_SUCH_VARIABLE, "no variable has handle " + std::to_string(handle) +
                                                 "; there are " +
                                                 std::to_string(variables_.size()));
}

std::int64_t VariableAccess::bytes_of(const google::protobuf::RepeatedField<int>& handles) const {
  std::int64_t count = 0;
  for (const int handle : handles) {
    check(handle);
    count += variables_[handle].size;
  }
  return kBytesOfValue * count;
}

void VariableAccess::check_inputs(const v1::Values& inputs, const std::string& field) const {
  std::int64_t size = 0;
  for (const int handle : inputs.handles()) {
    check(handle);
    const Variable& variable = variables_[handle];
    if (variable.causality != Causality::input && variable.causality != Causality::parameter)
      throw Refusal(v1::REASON_NOT_WRITABLE,
                    "variable \"" + utf8(variable.name) + "\" is neither an input nor a parameter");
    size += variable.size;
  }
  if (size != inputs.values_size())
    throw Refusal(v1::REASON_BAD_ARGUMENT, "`" + field + ".values`: the variables to write take " +
                                               std::to_string(size) + " values, got " +
                                               std::to_string(inputs.values_size()));
  for (const double value : inputs.values())
    if (!std::isfinite(value))
      throw Refusal(v1::REASON_BAD_ARGUMENT,
                    "`" + field + ".values`: a value to write is not finite");
}

void VariableAccess::check_condition(const v1::Condition& condition) const {
  check(condition.handle());
  const int size = variables_[condition.handle()].size;
  if (condition.element() < 0 || condition.element() >= size)
    throw Refusal(v1::REASON_BAD_ARGUMENT,
                  "`until.element` must be from 0 to " + std::to_string(size - 1));
  if (condition.comparison() == v1::COMPARISON_UNSPECIFIED)
    throw Refusal(v1::REASON_BAD_ARGUMENT, "`until.comparison` is missing");
  if (!v1::Comparison_IsValid(condition.comparison()))
    throw Refusal(v1::REASON_BAD_ARGUMENT, "`until.comparison` is unknown to this server");
  if (std::isnan(condition.threshold()))
    throw Refusal(v1::REASON_BAD_ARGUMENT, "`until.threshold` is not a number");
  if (condition.has_locate_within() && std::isinf(condition.locate_within()))
    throw Refusal(v1::REASON_BAD_ARGUMENT, "`until.locate_within` must be finite");
}

void VariableAccess::write(const v1::Values& inputs, Simulation& simulation) const {
  const double* value = inputs.values().data();
  for (const int handle : inputs.handles()) {
    const std::size_t size = variables_[handle].size;
    const auto status = simulation.set(handle, {value, size});
    if (!status) throw Refusal(status.error());
    value += size;
  }
}

void VariableAccess::read(const Simulation& simulation,
                          const google::protobuf::RepeatedField<int>& handles,
                          google::protobuf::RepeatedField<double>* out) const {
  constexpr std::size_t kKept = 1 << 16;
  thread_local std::vector<double> values;
  values.clear();
  for (const int handle : handles) simulation.get(handle, values);
  out->Add(values.begin(), values.end());
  if (values.size() > kKept) std::vector<double>().swap(values);
}

bool VariableAccess::holds(const v1::Condition& condition, const Simulation& simulation) const {
  thread_local std::vector<double> values;
  values.clear();
  simulation.get(condition.handle(), values);
  return compare(condition.comparison(), values[condition.element()], condition.threshold());
}

double VariableAccess::distance_behind(const v1::Condition& condition,
                                       const Simulation& simulation) const {
  thread_local std::vector<double> values;
  values.clear();
  simulation.get(condition.handle(), values);
  const double value = values[condition.element()];
  const bool rising = condition.comparison() == v1::COMPARISON_GREATER ||
                      condition.comparison() == v1::COMPARISON_GREATER_OR_EQUAL;
  const double distance = rising ? value - condition.threshold() : condition.threshold() - value;
  if (compare(condition.comparison(), value, condition.threshold())) return distance;
  return std::isnan(distance) ? distance : std::min(distance, -std::numeric_limits<double>::min());
}

}  // namespace mbcosim::server
