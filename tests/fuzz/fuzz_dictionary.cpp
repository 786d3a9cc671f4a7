/// Writes libFuzzer's dictionary: every word of the registry, and the punctuation around words.
#include <cstdio>
#include <fstream>
#include <set>
#include <string>

#include "elements/families.h"
#include "input/vocabulary.h"

namespace {

using namespace mbcosim;

std::set<std::string> entries() {
  std::set<std::string> all = {"begin: ",
                               "end: ",
                               "end for;",
                               "end if;",
                               ": ",
                               ", ",
                               ";\n",
                               "reference, ",
                               "global, ",
                               "node, ",
                               "local, ",
                               "null",
                               "eye",
                               "euler, ",
                               "diag, ",
                               "scale, ",
                               "matr, ",
                               "orientation, ",
                               "name, ",
                               "output, ",
                               "position, ",
                               "integer ",
                               "real ",
                               "string ",
                               "bool ",
                               "const ",
                               "ifndef ",
                               "model::",
                               "Time",
                               "Var",
                               "static",
                               "dynamic",
                               "algebraic",
                               "differential",
                               "\n%%file a.inc\n",
                               "&&",
                               "||",
                               "~|",
                               "/*",
                               "*/",
                               "other node, ",
                               "from nodes",
                               "same",
                               "velocity, ",
                               "range, ",
                               "degrees, ",
                               "guess",
                               "vector, ",
                               "sym, ",
                               "anba, ",
                               "skew, ",
                               "dummy, ",
                               "offset, ",
                               "2147483647",
                               "-2147483648",
                               "1e308",
                               "1e-308",
                               "[dof, ",
                               "[node, ",
                               "[element, "};
  for (const VocabularyGroup& group : vocabulary(full_registry()))
    for (const VocabularyWord& word : group.words) all.insert(word.word);
  return all;
}

std::string quoted(const std::string& text) {
  std::string r = "\"";
  for (const char c : text) {
    if (c == '\n')
      r += "\\x0A";
    else if (c == '"' || c == '\\')
      r += std::string("\\") + c;
    else
      r += c;
  }
  return r + "\"\n";
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fputs("usage: fuzz_dictionary FILE\n", stderr);
    return 4;
  }
  std::ofstream out(argv[1]);
  for (const std::string& entry : entries()) out << quoted(entry);
  return out ? 0 : 1;
}
