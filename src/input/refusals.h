/// Words of the language that will not be served.
#pragma once

#include <map>
#include <string>

namespace mbcosim {

struct Refusal {
  std::string word;    ///< as written in documentation
  std::string reason;  ///< "the reference solver has no such joint"
  std::string remedy;  ///< what to write instead; may be empty
  bool dead;           ///< the reference solver refuses the word, too
};

/// By context ("elements", "joint", "couple", "drive", "law", ...) and normalized word.
using Refusals = std::map<std::string, std::map<std::string, Refusal>>;
const Refusals& refusals();

}  // namespace mbcosim
