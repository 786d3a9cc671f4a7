/// What words mean in one place of the language.
#pragma once

#include <algorithm>
#include <atomic>
#include <mutex>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace mbcosim {

/// Words are stored without blanks and in lower case, as the language compares them.
std::string normalized(std::string_view word);

/// Values by word. Filled first; put in order when something is looked up for the first time, since
/// a deck asks few tables of all. Thread-safe once it is filled.
template <class Value>
class WordTable {
 public:
  struct Entry {
    std::string_view word;  ///< as written in documentation
    Value value;
    std::string key;  ///< the word, normalized
  };

  WordTable() = default;
  WordTable(const WordTable& other) : entries_(other.in_order()), is_in_order_(true) {}
  WordTable& operator=(const WordTable&) = delete;

  /// The last meaning of a word counts. `word` outlives the table: it is a literal.
  void add(std::string_view word, Value value) {
    is_in_order_.store(false, std::memory_order_relaxed);
    entries_.push_back({word, std::move(value), ""});
  }
  /// By a normalized word; null: it means nothing here.
  const Entry* find(std::string_view key) const {
    const std::vector<Entry>& entries = in_order();
    const auto found =
        std::lower_bound(entries.begin(), entries.end(), key,
                         [](const Entry& e, std::string_view k) { return e.key < k; });
    return found != entries.end() && found->key == key ? &*found : nullptr;
  }
  bool empty() const { return entries_.empty(); }
  /// By key.
  auto begin() const { return in_order().begin(); }
  auto end() const { return in_order().end(); }

 private:
  const std::vector<Entry>& in_order() const {
    if (is_in_order_.load(std::memory_order_acquire)) return entries_;
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!is_in_order_.load(std::memory_order_relaxed)) put_in_order();
    is_in_order_.store(true, std::memory_order_release);
    return entries_;
  }
  void put_in_order() const {
    for (Entry& e : entries_) e.key = normalized(e.word);
    std::reverse(entries_.begin(), entries_.end());  // of equal ones the first is kept below
    std::stable_sort(entries_.begin(), entries_.end(),
                     [](const Entry& a, const Entry& b) { return a.key < b.key; });
    entries_.erase(std::unique(entries_.begin(), entries_.end(),
                               [](const Entry& a, const Entry& b) { return a.key == b.key; }),
                   entries_.end());
  }

  mutable std::mutex mutex_;
  mutable std::vector<Entry> entries_;
  mutable std::atomic<bool> is_in_order_{true};
};

}  // namespace mbcosim
