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

/// "a, b or c".
std::string enumeration(const std::vector<std::string>& words);

}  // namespace mbcosim
