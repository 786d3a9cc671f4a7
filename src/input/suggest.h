/// Texts for messages about unknown words.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace mbcosim {

/// `did you mean "max iterations"?`; empty when no candidate is near. Blanks and case do not count.
std::string suggestion(std::string_view word, const std::vector<std::string>& candidates);

/// The same for words of the language; where none is near, where to find them.
std::string suggested_word(std::string_view word, const std::vector<std::string>& candidates);

/// Of a scalar function that is not defined: the nearest of those that are, or how to define it.
template <class Functions>
std::string suggested_function(std::string_view name, const Functions& defined) {
  std::vector<std::string> names;
  for (const auto& function : defined) names.push_back(function.first);
  const std::string near = suggestion(name, names);
  return near.empty() ? "define it before it is used: `scalar function: \"" + std::string(name) +
                            "\", <type>, ...;`"
                      : near;
}

/// "a, b or c".
std::string enumeration(const std::vector<std::string>& words);

}  // namespace mbcosim
