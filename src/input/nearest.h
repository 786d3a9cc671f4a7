/// Suggestions for mistyped words.
#pragma once

#include <string>
#include <string_view>

namespace mbcosim {

/// Collects the candidate that is nearest to a word: equal but for case, or within a third of its
/// letters mistyped.
class Nearest {
 public:
  explicit Nearest(std::string_view word);
  void consider(std::string_view candidate);
  const std::string& best() const { return best_; }   ///< empty: none is near
  bool is_case_of(std::string_view candidate) const;  ///< differs from it in case only

 private:
  std::string word_, lower_;
  std::string best_;
  int distance_;
};

}  // namespace mbcosim
