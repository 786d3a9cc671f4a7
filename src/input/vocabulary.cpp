#include "input/vocabulary.h"

#include <algorithm>

#include "input/cards.h"
#include "input/functions.h"
#include "input/grammar/grammar.h"
#include "input/refusals.h"
#include "input/symbols.h"
#include "model/family.h"
#include "model/node.h"

namespace mbcosim {

namespace {

/// Served words by their normalized form.
using Words = std::map<std::string, VocabularyWord>;

class Collector {
 public:
  explicit Collector(const Registry& registry) : registry_(registry) {}

  template <class Table>
  Words of(const Table& table) const {
    Words words;
    for (const auto& entry : table) words[entry.key].word = entry.word;
    return words;
  }

  Words laws() const {
    Words words;
    add_laws(words, registry_.laws1, 1);
    add_laws(words, registry_.laws3, 3);
    add_laws(words, registry_.laws6, 6);
    return words;
  }

  /// Appends a group of `words` and of those that `context` refuses.
  void group(std::string name, std::string title, Words words, const std::string& context = "") {
    const auto refused = registry_.not_supported.find(context);
    if (refused != registry_.not_supported.end())
      for (const auto& entry : refused->second)
        if (!words.count(entry.key))
          words[entry.key] = refused_word(std::string(entry.word), "", false);
    const auto never = refusals().find(context);
    if (never != refusals().end())
      for (const auto& [word, refusal] : never->second)
        if (!words.count(word))
          words[word] = refused_word(refusal.word, sentence(refusal), refusal.dead);
    VocabularyGroup g{std::move(name), std::move(title), "", {}};
    if (const auto found = grammars().find(g.name); found != grammars().end())
      g.form = found->second.form;
    for (auto& entry : words) {
      complete(g.name, entry.second);
      g.words.push_back(std::move(entry.second));
    }
    std::sort(g.words.begin(), g.words.end(),
              [](const auto& a, const auto& b) { return a.word < b.word; });
    groups.push_back(std::move(g));
  }

  void plain(std::string name, std::string title, const std::vector<std::string>& list) {
    Words words;
    for (const std::string& word : list) words[word].word = word;
    group(std::move(name), std::move(title), std::move(words));
  }

  std::vector<VocabularyGroup> groups;

 private:
  static VocabularyWord refused_word(std::string word, std::string reason, bool dead) {
    VocabularyWord refused;
    refused.word = std::move(word);
    refused.served = false;
    refused.reason = std::move(reason);
    refused.dead = dead;
    return refused;
  }
  /// What the grammar says of the word.
  static void complete(const std::string& group, VocabularyWord& word) {
    word.support = word.served           ? "yes"
                   : word.dead           ? "dead"
                   : word.reason.empty() ? "not yet"
                                         : "no";
    word.note = word.reason;
    if (!word.served) return;
    const WordGrammar* g = find_grammar(group, word.word);
    if (!g) return;
    word.form = g->form;
    word.grammar = g->text;
    word.output = g->output;
    word.note = g->note;
    if (!g->support.empty()) word.support = g->support;
    if (word.support == "no") word.reason = word.note;
    word.served = word.support != "no" && word.support != "not yet";
  }
  static std::string sentence(const Refusal& r) {
    return r.remedy.empty() ? r.reason : r.reason + "; " + r.remedy;
  }
  template <class Table>
  void add_laws(Words& words, const Table& table, int size) const {
    for (const auto& entry : table) {
      words[entry.key].word = entry.word;
      words[entry.key].sizes.push_back(size);
    }
  }

  const Registry& registry_;
};

std::vector<std::string> notation_words() { return grammars().at("notation").written; }

std::vector<std::string> constant_names() {
  const SymbolTable predefined;
  std::vector<std::string> names;
  for (const Symbol* symbol : predefined.sorted()) names.push_back(symbol->name);
  return names;
}

void add_blocks(Collector& c) {
  c.plain("block", "Blocks",
          {"data", "initial value", "inverse dynamics", "control data", "nodes", "drivers",
           "elements"});
  c.plain("data card", "Cards of `data`", {"problem"});
  c.plain("statement", "Statements that may stand anywhere",
          {"begin",
           "end",
           "set",
           "setenv",
           "include",
           "remark",
           "print symbol table",
           "exit",
           "chdir",
           "module load",
           "c81 data",
           "license",
           "warranty",
           "for",
           "end for",
           "if",
           "else if",
           "else",
           "end if",
           "reference",
           "drive caller",
           "template drive caller",
           "constitutive law",
           "scalar function",
           "hydraulic fluid"});
  c.plain("initial value card", "Cards of `initial value`", initial_value_words());
  c.plain("inverse dynamics card", "Cards of `inverse dynamics`", inverse_dynamics_words());
  c.plain("control card", "Cards of `control data`", control_words());
  c.plain("node", "Nodes", {kNodeWords.begin(), kNodeWords.end()});
}

void add_elements(Collector& c, const Registry& registry) {
  Words heads;
  for (const auto& [key, head] : registry.heads) heads[key].word = head.word;
  for (const char* word : {"bind", "driven", "output"}) heads[word].word = word;
  c.group("element", "Elements and statements of the block `elements`", std::move(heads),
          "elements");
  for (const FamilyFacts& family : all_families())
    for (const TypedHead& typed : family.typed) {
      const auto found = registry.heads.find(typed.head);
      c.group(typed.head, typed.title,
              found == registry.heads.end() ? Words{} : c.of(found->second.types), typed.head);
    }
}

}  // namespace

std::vector<VocabularyGroup> vocabulary(const Registry& registry) {
  Collector c(registry);
  add_blocks(c);
  add_elements(c, registry);
  c.group("drive", "Drives", c.of(registry.drives), "drive");
  c.group("law", "Constitutive laws", c.laws(), "law");
  c.group("function", "Scalar functions", c.of(registry.functions), "function");
  c.group("fluid", "Hydraulic fluids", c.of(registry.fluids), "fluid");
  c.group("file driver", "File drivers", c.of(registry.file_drivers), "file driver");
  c.plain("notation", "What cards are made of", notation_words());
  c.plain("expression function", "Functions of expressions", expression_function_names());
  c.plain("constant", "Constants of expressions", constant_names());
  return std::move(c.groups);
}

}  // namespace mbcosim
