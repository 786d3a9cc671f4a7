#include "input/suggest.h"

#include "input/nearest.h"
#include "model/registry.h"

namespace mbcosim {

std::string suggestion(std::string_view word, const std::vector<std::string>& candidates) {
  Nearest nearest(normalized(word));
  for (const std::string& candidate : candidates) nearest.consider(normalized(candidate));
  if (nearest.best().empty()) return "";
  for (const std::string& candidate : candidates)
    if (normalized(candidate) == nearest.best()) return "did you mean \"" + candidate + "\"?";
  return "";
}

std::string suggested_word(std::string_view word, const std::vector<std::string>& candidates) {
  const std::string near = suggestion(word, candidates);
  return near.empty() ? "`mbcosim keywords` lists the words, place by place" : near;
}

std::string enumeration(const std::vector<std::string>& words) {
  std::string text;
  for (std::size_t i = 0; i < words.size(); ++i) {
    if (i > 0) text += i + 1 == words.size() ? " or " : ", ";
    text += words[i];
  }
  return text;
}

}  // namespace mbcosim
