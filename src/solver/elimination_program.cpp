#include "solver/elimination_program.h"

#include <algorithm>
#include <functional>
#include <numeric>
#include <span>
#include <type_traits>
#include <utility>

#include "math/hash.h"

namespace mbcosim {

namespace {

constexpr std::size_t kSlice = 8;              ///< updates between two times of fetching
constexpr std::size_t kMostFetched = 1 << 16;  ///< numbers in a range
constexpr std::size_t kLine = 8;               ///< numbers in a line of a cache

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

template <class Each>
void add(Digest& digest, const std::vector<Each>& all) {
  static_assert(std::has_unique_object_representations_v<Each>);
  digest.add({reinterpret_cast<const char*>(all.data()), bytes_of(all)});
}

}  // namespace

std::size_t NumberRanges::Range::lines() const {
  return (static_cast<std::size_t>(end - first) + kLine - 1) / kLine;
}

void NumberRanges::add(const double* first, std::size_t count) {
  const double* const end = first + count;
  if (count == 0 || count > kMostFetched) return;
  for (Range& each : std::span(ranges_).first(count_)) {
    if (std::less_equal<>()(end, each.first) || std::less_equal<>()(each.end, first)) continue;
    each = {std::min(first, each.first, std::less<>()), std::max(end, each.end, std::less<>())};
    return;
  }
  ranges_[count_++] = {first, end};
}

std::size_t NumberRanges::lines() const {
  std::size_t sum = 0;
  for (const Range& each : std::span(ranges_).first(count_)) sum += each.lines();
  return sum;
}

void NumberRanges::fetch(std::size_t lines) {
  for (; next_ < count_; ++next_)
    for (Range& each = ranges_[next_]; each.first < each.end; each.first += kLine) {
      if (lines-- == 0) return;
      __builtin_prefetch(each.first);
    }
}

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

/// The draft's: values as they lie, updates level by level and within a level as they were given.
EliminationProgram::Operations EliminationProgram::sorted() {
  Draft& d = *draft_;
  std::sort(d.entries.begin(), d.entries.end(),
            [](const Entry& a, const Entry& b) { return a.value < b.value; });
  std::vector<std::size_t> at(d.end_level - d.first_level + 1, 0);
  for (const Update& update : d.updates) ++at[update.level - d.first_level + 1];
  std::partial_sum(at.begin(), at.end(), at.begin());
  std::vector<const Update*> by_level(d.updates.size());
  for (const Update& update : d.updates) by_level[at[update.level - d.first_level]++] = &update;
  Operations operations;
  operations.updates.reserve(by_level.size());
  operations.products.reserve(d.products.size());
  for (const Update* update : by_level) {
    operations.updates.push_back(update->what);
    const auto first = d.products.begin() + static_cast<std::ptrdiff_t>(update->first);
    operations.products.insert(operations.products.end(), first, first + update->what.products);
  }
  d.updates.clear();
  d.products.clear();
  operations.zeros = taken(d.zeros);
  operations.entries = taken(d.entries);
  operations.required = taken(d.required);
  d.first_level = d.end_level;
  return operations;
}

EliminationProgram::Window EliminationProgram::count_from_first(Operations& operations) {
  const auto each_factor = [&](auto use) {
    for (NumberProduct& each : operations.products) use(each.factor);
    for (NumberUpdate& each : operations.updates)
      if (each.divides) use(each.pivot);
  };
  const auto each_other = [&](auto use) {
    for (Zeros& each : operations.zeros) use(each.target);
    for (Entry& each : operations.entries) use(each.target);
    for (NumberUpdate& each : operations.updates) use(each.target);
    for (NumberProduct& each : operations.products) use(each.other);
    for (std::uint32_t& each : operations.required) use(each);
  };
  const auto from_first = [](const auto& each_place, std::uint32_t& first, std::size_t& end) {
    std::optional<std::uint32_t> least;
    each_place([&](std::uint32_t each) { least = std::min(least.value_or(each), each); });
    first = least.value_or(0) / kBlock * kBlock;
    each_place([&](std::uint32_t& each) {
      each -= first;
      end = std::max<std::size_t>(end, each + kBlock);
    });
  };
  Window window{.operations = 0};
  from_first(each_factor, window.factor, operations.factors_end);
  from_first(each_other, window.number, operations.numbers_end);
  if (operations.entries.empty()) return window;
  window.value = operations.entries.front().value;
  window.scale = std::ranges::min(operations.entries, {}, &Entry::scale).scale;
  operations.values_end = operations.entries.back().value + 1 - window.value;
  for (Entry& each : operations.entries) {
    each.value -= window.value;
    each.scale -= window.scale;
  }
  return window;
}

void EliminationProgram::end_window() {
  if (draft_->zeros.empty() && draft_->entries.empty() && draft_->updates.empty() &&
      draft_->required.empty())
    return;
  Operations operations = sorted();
  Window window = count_from_first(operations);
  const auto known = draft_->known.try_emplace(operations.digest(), operations_.size()).first;
  window.operations = known->second;
  const bool same = window.operations < static_cast<int>(operations_.size()) &&
                    operations_[window.operations] == operations;
  if (!same) {
    window.operations = static_cast<int>(operations_.size());
    bytes_ += operations.bytes();
    operations_.push_back(std::move(operations));
  }
  windows_.push_back(window);
}

void EliminationProgram::finish() {
  end_window();
  draft_.reset();
}

NumberRanges EliminationProgram::ranges(const Window& window, const double* values,
                                        const double* numbers) const {
  const Operations& operations = operations_[window.operations];
  NumberRanges all;
  all.add(values + window.value, operations.values_end);
  all.add(numbers + window.factor, operations.factors_end);
  all.add(numbers + window.number, operations.numbers_end);
  return all;
}

std::optional<EliminationProgram::Sizes> EliminationProgram::run(const PanelVersion& version,
                                                                 const double* values,
                                                                 const double* scales,
                                                                 double* numbers) const {
  Sizes sizes;
  for (std::size_t w = 0; w < windows_.size(); ++w) {
    const Window& window = windows_[w];
    const Operations& operations = operations_[window.operations];
    double* const first = numbers + window.number;
    for (const Zeros& zeros : operations.zeros) std::fill_n(first + zeros.target, zeros.count, 0.0);
    for (const Entry& entry : operations.entries)
      first[entry.target] = values[window.value + entry.value] * scales[window.scale + entry.scale];

    const std::size_t updates = operations.updates.size();
    const bool fetches = fetches_ && w + 1 < windows_.size();
    NumberRanges next = fetches ? ranges(windows_[w + 1], values, numbers) : NumberRanges();
    const std::size_t slices = fetches ? 1 + updates / kSlice : 1;
    const std::size_t lines = 1 + next.lines() / slices, slice = 1 + updates / slices;
    const NumberProduct* products = operations.products.data();
    for (std::size_t k = 0; k < updates; k += slice) {
      next.fetch(lines);
      products = version.update(operations.updates.data() + k, std::min(slice, updates - k),
                                products, numbers + window.factor, first);
    }
    for (const std::uint32_t required : operations.required) {
      const double size = std::abs(first[required]);
      if (!(size > 0 && size < HUGE_VAL)) return std::nullopt;
      sizes.smallest = std::min(sizes.smallest, size);
      sizes.largest = std::max(sizes.largest, size);
    }
  }
  return sizes;
}

std::uint64_t EliminationProgram::Operations::digest() const {
  Digest digest;
  add(digest, zeros);
  add(digest, entries);
  add(digest, updates);
  add(digest, products);
  add(digest, required);
  return digest.value();
}

std::size_t EliminationProgram::Operations::bytes() const {
  return sizeof *this + bytes_of(zeros) + bytes_of(entries) + bytes_of(updates) +
         bytes_of(products) + bytes_of(required);
}

}  // namespace mbcosim
