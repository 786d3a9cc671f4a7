#include "solver/elimination_program.h"

#include <algorithm>

namespace mbcosim {

namespace {

EliminationProgram::Place place(std::size_t at) {
  return static_cast<EliminationProgram::Place>(at);
}

/// Those of each level behind each other, within a level in the order in which they were given.
template <class Ordered>
void sort_by_level(std::vector<Ordered>& all) {
  std::stable_sort(all.begin(), all.end(),
                   [](const Ordered& a, const Ordered& b) { return a.level < b.level; });
}

}  // namespace

void EliminationProgram::set(std::size_t target, int value, double scale) {
  entries_.push_back({value, place(target), scale});
}

void EliminationProgram::subtract_product(std::size_t target, std::size_t factor,
                                          std::size_t other) {
  const int level = std::max({ready_[target], read_[target], ready_[factor], ready_[other]});
  ready_[target] = level;
  read_[factor] = std::max(read_[factor], level);
  read_[other] = std::max(read_[other], level);
  ordered_updates_.push_back({level, {place(target), place(factor), place(other)}});
}

void EliminationProgram::divide(std::size_t target, std::size_t pivot) {
  const int level = std::max({ready_[target], read_[target], ready_[pivot]});
  ready_[target] = level + 1;
  read_[pivot] = std::max(read_[pivot], level + 1);
  ordered_divisions_.push_back({level, {place(target), place(pivot)}});
}

void EliminationProgram::finish() {
  sort_by_level(ordered_updates_);
  sort_by_level(ordered_divisions_);
  const int levels = ready_.empty() ? 0 : *std::max_element(ready_.begin(), ready_.end()) + 1;
  ends_.resize(levels);
  for (const auto& update : ordered_updates_) {
    updates_.push_back(update.operation);
    ends_[update.level].updates = updates_.size();
  }
  for (const auto& division : ordered_divisions_) {
    divisions_.push_back(division.operation);
    ends_[division.level].divisions = divisions_.size();
  }
  for (int k = 1; k < levels; ++k) {
    ends_[k].updates = std::max(ends_[k].updates, ends_[k - 1].updates);
    ends_[k].divisions = std::max(ends_[k].divisions, ends_[k - 1].divisions);
  }
  ordered_updates_ = {};
  ordered_divisions_ = {};
  ready_ = {};
  read_ = {};
}

void EliminationProgram::run(const double* values, double* numbers) const {
  for (const Entry& entry : entries_) numbers[entry.target] = values[entry.value] * entry.scale;
  const Update* update = updates_.data();
  const Division* division = divisions_.data();
  for (const Range& end : ends_) {
    for (const Update* const last = updates_.data() + end.updates; update != last; ++update)
      numbers[update->target] -= numbers[update->factor] * numbers[update->other];
    for (const Division* const last = divisions_.data() + end.divisions; division != last;
         ++division)
      numbers[division->target] /= numbers[division->pivot];
  }
}

std::size_t EliminationProgram::bytes() const {
  return sizeof(Entry) * entries_.size() + sizeof(Update) * updates_.size() +
         sizeof(Division) * divisions_.size() + sizeof(Range) * ends_.size();
}

}  // namespace mbcosim
