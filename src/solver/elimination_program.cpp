#include "solver/elimination_program.h"

#include <algorithm>
#include <numeric>

namespace mbcosim {

namespace {

std::uint32_t place(std::size_t at) { return static_cast<std::uint32_t>(at); }

/// Into as much memory as they need.
template <class Each>
std::vector<Each> taken(std::vector<Each>& from) {
  std::vector<Each> all(from.begin(), from.end());
  from.clear();
  return all;
}

template <class Each>
std::size_t bytes_of(const std::vector<Each>& all) {
  return sizeof(Each) * all.size();
}

}  // namespace

/// Rows and columns of factors come by turns.
void EliminationProgram::clear(std::size_t target, std::size_t count) {
  constexpr std::size_t kStreams = 2;
  std::vector<Zeros>& zeros = draft_->zeros;
  for (std::size_t back = 1; back <= std::min(kStreams, zeros.size()); ++back) {
    Zeros& each = zeros[zeros.size() - back];
    if (each.target + each.count != target) continue;
    each.count += place(count);
    return;
  }
  zeros.push_back({place(target), place(count)});
}

void EliminationProgram::set(std::size_t target, int value, int scale) {
  draft_->entries.push_back({value, scale, place(target)});
}

void EliminationProgram::begin(std::size_t target, int count) {
  if (draft_->products.size() >= window_) close_window();
  draft_->open = {{place(target), 0, 0, static_cast<std::uint16_t>(count), false, false},
                  draft_->products.size(),
                  0};
}

void EliminationProgram::subtract_product(std::size_t factor, std::size_t other) {
  draft_->products.push_back({place(factor), place(other)});
}

void EliminationProgram::subtract_dot(std::size_t factor, std::size_t other) {
  draft_->open.what.dots = true;
  subtract_product(factor, other);
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
  update.level = std::max({d.first_level, of_target.ready, of_target.read + 1});
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
  draft_->end_level = std::max(draft_->end_level, update.level + 1);
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

void EliminationProgram::require(std::size_t pivot) { draft_->required.push_back(place(pivot)); }

/// Values as they lie, updates level by level and within a level as they were given.
void EliminationProgram::close_window() {
  Draft& d = *draft_;
  std::sort(d.entries.begin(), d.entries.end(),
            [](const Entry& a, const Entry& b) { return a.value < b.value; });
  std::vector<std::size_t> at(d.end_level - d.first_level + 1, 0);
  for (const Update& update : d.updates) ++at[update.level - d.first_level + 1];
  std::partial_sum(at.begin(), at.end(), at.begin());
  std::vector<const Update*> sorted(d.updates.size());
  for (const Update& update : d.updates) sorted[at[update.level - d.first_level]++] = &update;
  Window& window = windows_.emplace_back();
  window.updates.reserve(sorted.size());
  window.products.reserve(d.products.size());
  for (const Update* update : sorted) {
    window.updates.push_back(update->what);
    const auto first = d.products.begin() + static_cast<std::ptrdiff_t>(update->first);
    window.products.insert(window.products.end(), first, first + update->what.products);
  }
  d.updates.clear();
  d.products.clear();
  window.zeros = taken(d.zeros);
  window.entries = taken(d.entries);
  window.required = taken(d.required);
  d.first_level = d.end_level;
}

void EliminationProgram::finish() {
  close_window();
  draft_.reset();
}

std::optional<EliminationProgram::Sizes> EliminationProgram::run(const PanelVersion& version,
                                                                 const double* values,
                                                                 const double* scales,
                                                                 double* numbers) const {
  Sizes sizes;
  for (const Window& window : windows_) {
    for (const Zeros& zeros : window.zeros) std::fill_n(numbers + zeros.target, zeros.count, 0.0);
    for (const Entry& entry : window.entries)
      numbers[entry.target] = values[entry.value] * scales[entry.scale];
    version.update(window.updates.data(), window.updates.size(), window.products.data(), numbers);
    for (const std::uint32_t required : window.required) {
      const double size = std::abs(numbers[required]);
      if (!(size > 0 && size < HUGE_VAL)) return std::nullopt;
      sizes.smallest = std::min(sizes.smallest, size);
      sizes.largest = std::max(sizes.largest, size);
    }
  }
  return sizes;
}

std::size_t EliminationProgram::bytes() const {
  std::size_t bytes = bytes_of(windows_);
  for (const Window& window : windows_)
    bytes += bytes_of(window.zeros) + bytes_of(window.entries) + bytes_of(window.updates) +
             bytes_of(window.products) + bytes_of(window.required);
  return bytes;
}

}  // namespace mbcosim
