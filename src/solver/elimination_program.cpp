#include "solver/elimination_program.h"

#include <Eigen/Core>
#include <algorithm>
#include <numeric>

namespace mbcosim {

namespace {

std::uint32_t place(std::size_t at) { return static_cast<std::uint32_t>(at); }

template <int N>
using Numbers = Eigen::Map<Eigen::Array<double, N, 1>>;
template <int N>
using NumbersRead = Eigen::Map<const Eigen::Array<double, N, 1>>;

/// Two at a time. Wider ones would wait for each other: what two narrow ones have stored cannot be
/// loaded at once before it is in the cache.
template <class Use>
inline void for_run(int count, Use use) {
  int i = 0;
  for (; i + 2 <= count; i += 2) use.template operator()<2>(i);
  if (i < count) use.template operator()<1>(i);
}

/// Those of each level behind each other, within a level in the order in which they were given.
/// Where each level ends.
template <class Operation>
std::vector<std::size_t> sort_by_level(std::vector<Operation>& all, std::vector<int>& level,
                                       std::size_t levels) {
  std::vector<std::size_t> at(levels + 1, 0);
  for (const int each : level) ++at[each + 1];
  std::partial_sum(at.begin(), at.end(), at.begin());
  std::vector<Operation> sorted(all.size());
  for (std::size_t k = 0; k < all.size(); ++k) sorted[at[level[k]]++] = all[k];
  all = std::move(sorted);
  level = {};
  return at;
}

}  // namespace

void EliminationProgram::set(std::size_t target, int value, double scale) {
  entries_.push_back({value, place(target), scale});
}

/// The first one after which none of them changes the order of what is done with them.
int EliminationProgram::level_of_targets(std::size_t target, std::size_t count) const {
  int level = 0;
  for (std::size_t i = target; i < target + count; ++i)
    level = std::max({level, ready_[i], read_[i]});
  return level;
}

void EliminationProgram::subtract_products(std::size_t target, std::size_t factor,
                                           std::size_t count, std::size_t other) {
  int level = std::max(level_of_targets(target, count), ready_[other]);
  for (std::size_t i = factor; i < factor + count; ++i) level = std::max(level, ready_[i]);
  std::fill_n(ready_.begin() + static_cast<std::ptrdiff_t>(target), count, level);
  for (std::size_t i = factor; i < factor + count; ++i) read_[i] = std::max(read_[i], level);
  read_[other] = std::max(read_[other], level);
  products_.push_back({place(target), place(factor), place(other), place(count)});
  level_of_products_.push_back(level);
}

void EliminationProgram::divide(std::size_t target, std::size_t count, std::size_t pivot) {
  const int level = std::max(level_of_targets(target, count), ready_[pivot]);
  std::fill_n(ready_.begin() + static_cast<std::ptrdiff_t>(target), count, level + 1);
  read_[pivot] = std::max(read_[pivot], level + 1);
  quotients_.push_back({place(target), place(pivot), place(count)});
  level_of_quotients_.push_back(level);
}

void EliminationProgram::finish() {
  const std::size_t levels =
      ready_.empty() ? 0 : *std::max_element(ready_.begin(), ready_.end()) + 1;
  const auto products = sort_by_level(products_, level_of_products_, levels);
  const auto quotients = sort_by_level(quotients_, level_of_quotients_, levels);
  for (std::size_t k = 0; k < levels; ++k) ends_.push_back({products[k], quotients[k]});
  ready_ = {};
  read_ = {};
}

void EliminationProgram::run(const double* values, double* numbers) const {
  for (const Entry& entry : entries_) numbers[entry.target] = values[entry.value] * entry.scale;
  const Products* products = products_.data();
  const Quotients* quotients = quotients_.data();
  for (const Range& end : ends_) {
    for (const Products* const last = products_.data() + end.products; products != last; ++products)
      for_run(products->count, [to = numbers + products->target, from = numbers + products->factor,
                                other = numbers[products->other]]<int N>(int i) {
        Numbers<N>(to + i) -= NumbersRead<N>(from + i) * other;
      });
    for (const Quotients* const last = quotients_.data() + end.quotients; quotients != last;
         ++quotients)
      for_run(quotients->count,
              [to = numbers + quotients->target, pivot = numbers[quotients->pivot]]<int N>(int i) {
                Numbers<N>(to + i) /= pivot;
              });
  }
}

std::size_t EliminationProgram::bytes() const {
  return sizeof(Entry) * entries_.size() + sizeof(Products) * products_.size() +
         sizeof(Quotients) * quotients_.size() + sizeof(Range) * ends_.size();
}

}  // namespace mbcosim
