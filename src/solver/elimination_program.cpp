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

/// `all` level by level, within a level in the order in which they were given. Where each level
/// ends.
template <class Operation>
std::vector<std::size_t> sort_by_level(const std::deque<Operation>& all,
                                       const std::deque<int>& level, std::size_t levels,
                                       std::vector<Operation>& sorted) {
  std::vector<std::size_t> at(levels + 1, 0);
  for (const int each : level) ++at[each + 1];
  std::partial_sum(at.begin(), at.end(), at.begin());
  sorted.resize(all.size());
  auto of = level.begin();
  for (const Operation& each : all) sorted[at[*of++]++] = each;
  return at;
}

}  // namespace

void EliminationProgram::set(std::size_t target, int value, double scale) {
  draft_->entries.push_back({value, place(target), scale});
}

/// The first one after which none of them changes the order of what is done with them.
int EliminationProgram::level_of_targets(std::size_t target, std::size_t count) const {
  int level = 0;
  for (std::size_t i = target; i < target + count; ++i)
    level = std::max({level, draft_->uses[i].ready, draft_->uses[i].read});
  return level;
}

void EliminationProgram::subtract_products(std::size_t target, std::size_t factor,
                                           std::size_t count, std::size_t other) {
  std::vector<Uses>& uses = draft_->uses;
  int level = std::max(level_of_targets(target, count), uses[other].ready);
  for (std::size_t i = factor; i < factor + count; ++i) level = std::max(level, uses[i].ready);
  for (std::size_t i = target; i < target + count; ++i) uses[i].ready = level;
  for (std::size_t i = factor; i < factor + count; ++i)
    uses[i].read = std::max(uses[i].read, level);
  uses[other].read = std::max(uses[other].read, level);
  draft_->products.push_back({place(target), place(factor), place(other), place(count)});
  draft_->level_of_products.push_back(level);
}

void EliminationProgram::divide(std::size_t target, std::size_t count, std::size_t pivot) {
  std::vector<Uses>& uses = draft_->uses;
  const int level = std::max(level_of_targets(target, count), uses[pivot].ready);
  for (std::size_t i = target; i < target + count; ++i) uses[i].ready = level + 1;
  uses[pivot].read = std::max(uses[pivot].read, level + 1);
  draft_->quotients.push_back({place(target), place(pivot), place(count)});
  draft_->level_of_quotients.push_back(level);
}

void EliminationProgram::finish() {
  std::size_t levels = 0;
  for (const Uses& each : draft_->uses) levels = std::max<std::size_t>(levels, each.ready + 1);
  entries_.assign(draft_->entries.begin(), draft_->entries.end());
  const auto products =
      sort_by_level(draft_->products, draft_->level_of_products, levels, products_);
  const auto quotients =
      sort_by_level(draft_->quotients, draft_->level_of_quotients, levels, quotients_);
  for (std::size_t k = 0; k < levels; ++k) ends_.push_back({products[k], quotients[k]});
  draft_.reset();
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
