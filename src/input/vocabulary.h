/// The words of the language by place: what the feature tables of LANGUAGE.md and the editor
/// grammar are checked against.
#pragma once

#include <string>
#include <vector>

#include "model/registry.h"

namespace mbcosim {

struct VocabularyWord {
  std::string word;        ///< as written in documentation, "revolute hinge"
  bool served = true;      ///< false: known and refused by name
  std::string reason;      ///< why it will never be served; else empty
  bool dead = false;       ///< the reference solver refuses it, too
  std::vector<int> sizes;  ///< of constitutive laws: 1, 3, 6
  std::string support;     ///< yes, partly, ignored, not yet, no, dead
  std::string note;        ///< on the support
  std::string form;        ///< of its statements; empty: that of the group
  std::string grammar;  ///< what stands after the word; `input/grammar/grammar.h` has the notation
  std::string output;   ///< columns of the results, with units
};

/// Words that may stand in one place, sorted.
struct VocabularyGroup {
  std::string name;   ///< "joint", "drive", "initial value card"
  std::string title;  ///< "Joints"
  std::string form;   ///< of the statements: "joint : <label> , <word> , <grammar> ;"
  std::vector<VocabularyWord> words;
};

std::vector<VocabularyGroup> vocabulary(const Registry& registry);

}  // namespace mbcosim
