#include "solver/elimination_program.h"

#include <algorithm>
#include <numeric>

namespace mbcosim {

namespace {

std::uint32_t place(std::size_t at) { return static_cast<std::uint32_t>(at); }

}  // namespace

void EliminationProgram::set(std::size_t target, int value, double scale) {
  draft_->entries.push_back({value, place(target), scale});
}

void EliminationProgram::begin(std::size_t target, int count) {
  draft_->open = {
      {place(target), 0, 0, static_cast<std::uint16_t>(count), false}, draft_->products.size(), 0};
}

void EliminationProgram::subtract_product(std::size_t factor, std::size_t other) {
  draft_->products.push_back({place(factor), place(other)});
}

void EliminationProgram::end(std::optional<std::size_t> pivot) {
  Draft& d = *draft_;
  Update& update = d.open;
  NumberUpdate& what = update.what;
  what.products = place(d.products.size() - update.first);
  if (what.products == 0 && !pivot) return;
  what.divides = pivot.has_value();
  what.pivot = place(pivot.value_or(0));
  const Uses& of_target = uses_of(what.target);
  update.level = std::max(of_target.ready, of_target.read + 1);
  if (pivot) update.level = std::max(update.level, uses_of(*pivot).ready);
  for (std::size_t p = update.first; p < d.products.size(); ++p)
    for (const std::size_t needed : {d.products[p].factor, d.products[p].other})
      update.level = std::max(update.level, uses_of(needed).ready);
  if (extends_last(update)) {
    Update& last = d.updates.back();
    last.level = std::max(last.level, update.level);
    last.what.count = static_cast<std::uint16_t>(last.what.count + kBlock);
    mark(last);
    d.products.resize(update.first);
    return;
  }
  mark(update);
  d.updates.push_back(update);
}

/// Blocks side by side for which the same is done with neighbours.
bool EliminationProgram::extends_last(const Update& update) const {
  const Draft& d = *draft_;
  if (d.updates.empty() || update.what.count != kBlock) return false;
  const NumberUpdate &last = d.updates.back().what, &what = update.what;
  if (last.count % kBlock != 0 || last.count >= NumberUpdate::kMost ||
      last.target + last.count != what.target || last.products != what.products ||
      last.divides != what.divides || last.pivot != what.pivot)
    return false;
  const auto of_last = d.products.begin() + static_cast<std::ptrdiff_t>(d.updates.back().first);
  return std::equal(of_last, of_last + what.products,
                    d.products.begin() + static_cast<std::ptrdiff_t>(update.first),
                    [&](const NumberProduct& a, const NumberProduct& b) {
                      return a.factor + last.count == b.factor && a.other == b.other;
                    });
}

void EliminationProgram::mark(const Update& update) {
  const NumberUpdate& what = update.what;
  const auto read = [&](std::size_t at) {
    Uses& uses = uses_of(at);
    uses.read = std::max(uses.read, update.level);
  };
  for (std::size_t p = update.first; p < update.first + what.products; ++p) {
    const NumberProduct& product = draft_->products[p];
    for (std::size_t i = 0; i < what.count; i += kBlock) read(product.factor + i);
    read(product.other);
  }
  if (what.divides) read(what.pivot);
  for (std::size_t i = 0; i < what.count; i += kBlock)
    uses_of(what.target + i).ready = update.level + 1;
}

/// Level by level, within a level as they were given.
void EliminationProgram::finish() {
  const Draft& d = *draft_;
  entries_.assign(d.entries.begin(), d.entries.end());
  int levels = 0;
  for (const Update& update : d.updates) levels = std::max(levels, update.level + 1);
  std::vector<std::size_t> at(levels + 1, 0);
  for (const Update& update : d.updates) ++at[update.level + 1];
  std::partial_sum(at.begin(), at.end(), at.begin());
  std::vector<const Update*> sorted(d.updates.size());
  for (const Update& update : d.updates) sorted[at[update.level]++] = &update;
  updates_.reserve(sorted.size());
  products_.reserve(d.products.size());
  for (const Update* update : sorted) {
    updates_.push_back(update->what);
    const auto first = d.products.begin() + static_cast<std::ptrdiff_t>(update->first);
    products_.insert(products_.end(), first, first + update->what.products);
  }
  draft_.reset();
}

void EliminationProgram::run(const PanelVersion& version, const double* values,
                             double* numbers) const {
  for (const Entry& entry : entries_) numbers[entry.target] = values[entry.value] * entry.scale;
  version.update(updates_.data(), updates_.size(), products_.data(), numbers);
}

std::size_t EliminationProgram::bytes() const {
  return sizeof(Entry) * entries_.size() + sizeof(NumberUpdate) * updates_.size() +
         sizeof(NumberProduct) * products_.size();
}

}  // namespace mbcosim
