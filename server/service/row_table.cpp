#include "service/row_table.h"

#include <algorithm>

#include "wire/refusal.h"

namespace mbcosim::server {
namespace {

std::int64_t checked_every(const v1::TableRequest& request) {
  if (!request.has_every()) return 1;
  if (request.every() < 1)
    throw Refusal(v1::REASON_BAD_ARGUMENT,
                  "`table.every` must be at least 1, got " + std::to_string(request.every()));
  return request.every();
}

}  // namespace

RowTable::RowTable(const v1::TableRequest& request, const VariableAccess& variables,
                   MemoryBudget& memory)
    : variables_(variables),
      handles_(request.handles()),
      every_(checked_every(request)),
      with_start_(!request.without_start()),
      share_(memory) {
  variables.check(handles_);
  std::int64_t values = 2;
  for (const int handle : handles_) values += variables.variables()[handle].size;
  const std::int64_t block = std::max<std::int64_t>(kBlockValues, values) + values;
  share_.grow(VariableAccess::kBytesOfValue * block);
}

void RowTable::put(const Simulation& simulation) {
  block_.add_steps(simulation.step_number());
  block_.add_times(simulation.time());
  variables_.read(simulation, handles_, block_.mutable_values());
  since_ = 0;
}

void RowTable::start(const Simulation& simulation) {
  if (with_start_) put(simulation);
}

void RowTable::add(const Simulation& simulation) {
  if (++since_ >= every_) put(simulation);
}

void RowTable::finish(const Simulation& simulation) {
  if (since_ > 0) put(simulation);
}

void RowTable::take(v1::TableBlock* out) {
  out->Clear();
  out->Swap(&block_);
}

}  // namespace mbcosim::server
