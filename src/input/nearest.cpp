#include "input/nearest.h"

#include <algorithm>
#include <cctype>
#include <vector>

namespace mbcosim {

namespace {

std::string lower_case(std::string_view s) {
  std::string r(s);
  for (char& c : r) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return r;
}

/// Levenshtein distance with neighbouring letters swapped at cost 1.
int edit_distance(const std::string& a, const std::string& b) {
  const int n = static_cast<int>(a.size()), m = static_cast<int>(b.size());
  std::vector<int> before(m + 1), last(m + 1), row(m + 1);
  for (int j = 0; j <= m; ++j) last[j] = j;
  for (int i = 1; i <= n; ++i) {
    row[0] = i;
    for (int j = 1; j <= m; ++j) {
      row[j] = std::min({last[j] + 1, row[j - 1] + 1, last[j - 1] + (a[i - 1] != b[j - 1])});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        row[j] = std::min(row[j], before[j - 2] + 1);
    }
    before.swap(last);
    last.swap(row);
  }
  return last[m];
}

constexpr std::size_t kLongestCompared = 60;

}  // namespace

Nearest::Nearest(std::string_view word)
    : word_(word.substr(0, kLongestCompared)),
      lower_(lower_case(word_)),
      distance_(static_cast<int>(word_.size()) / 3 + 1) {}

bool Nearest::is_case_of(std::string_view candidate) const {
  return lower_ == lower_case(candidate);
}

void Nearest::consider(std::string_view candidate) {
  if (candidate.size() > word_.size() + distance_ || word_.size() > candidate.size() + distance_)
    return;
  const int d = edit_distance(lower_, lower_case(candidate));
  if (d < distance_) {
    distance_ = d;
    best_ = candidate;
  }
}

}  // namespace mbcosim
