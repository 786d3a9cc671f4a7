#include "input/grammar/grammar.h"

#include <algorithm>
#include <set>
#include <sstream>

#include "input/grammar/texts.h"
#include "model/registry.h"

namespace mbcosim {

namespace {

constexpr const char* kPreloads = " [ , prestress , <stress> ] [ , prestrain , <strain drive> ]";

/// What follows the mark and a blank.
std::string content(const std::string& line) {
  return line.size() > 4 ? line.substr(4) : std::string();
}

void read_group(const std::string& line, std::map<std::string, GroupGrammar>& all,
                GroupGrammar*& group) {
  const std::size_t bar = line.find(" | ");
  group = &all[line.substr(2, bar - 2)];
  group->form = line.substr(bar + 3);
}

/// `! partly: why`
void read_support(const std::string& text, WordGrammar& word) {
  const std::size_t colon = text.find(": ");
  word.support = text.substr(0, colon);
  if (colon != text.npos) word.note = text.substr(colon + 2);
}

void read_texts(const char* texts, std::map<std::string, GroupGrammar>& all) {
  std::istringstream in(texts);
  GroupGrammar* group = nullptr;
  WordGrammar* word = nullptr;
  for (std::string line; std::getline(in, line);) {
    if (line.empty()) continue;
    if (line[0] == '@') {
      read_group(line, all, group);
    } else if (line[0] != ' ') {
      word = &group->words[normalized(line)];
      word->word = line;
      group->written.push_back(line);
    } else if (line[2] == ':') {
      word->form = content(line);
    } else if (line[2] == '=') {
      word->text = content(line);
    } else if (line[2] == '>') {
      word->output = content(line);
    } else if (line[2] == '+') {
      word->text += kPreloads;
    } else if (line[2] == '!') {
      read_support(content(line), *word);
    }
  }
}

void replace(std::string& text, std::string_view what, std::string_view with) {
  if (const std::size_t at = text.find(what); at != text.npos) text.replace(at, what.size(), with);
}

/// Arguments that a form may have, where the word has them or has none.
void settle_optional(std::string& form, const std::string& mark, bool some) {
  replace(form, " [ " + mark + " <grammar> ]", some ? " " + mark + " <grammar>" : "");
}

}  // namespace

const std::map<std::string, GroupGrammar>& grammars() {
  static const std::map<std::string, GroupGrammar> all = [] {
    std::map<std::string, GroupGrammar> m;
    using namespace grammar;
    for (const char* texts : {kBlocks, kControl, kNodes, kElements, kJoints, kObjects, kNotation})
      read_texts(texts, m);
    return m;
  }();
  return all;
}

const WordGrammar* find_grammar(std::string_view group, std::string_view word) {
  const auto g = grammars().find(std::string(group));
  if (g == grammars().end()) return nullptr;
  const auto w = g->second.words.find(normalized(word));
  return w == g->second.words.end() ? nullptr : &w->second;
}

bool is_word_of_language(std::string_view word) {
  const std::string name = normalized(word);
  return std::any_of(grammars().begin(), grammars().end(),
                     [&](const auto& group) { return group.second.words.contains(name); });
}

std::string written_form(std::string_view group, std::string_view word) {
  constexpr std::size_t kLongest = 400;  // bytes
  const WordGrammar* const w = find_grammar(group, word);
  if (!w) return "";
  std::string form = w->form.empty() ? grammars().at(std::string(group)).form : w->form;
  settle_optional(form, ":", !w->text.empty());
  settle_optional(form, ",", !w->text.empty());
  replace(form, "<word>", w->word);
  replace(form, "<grammar>", w->text);
  if (form.size() <= kLongest) return form;
  return form.substr(0, form.rfind(' ', kLongest)) + " …";
}

void add_form(Diagnostic& d, std::string_view group, std::string_view word) {
  if (!d.hint.empty() || d.code == "internal" || d.code == "not-supported") return;
  if (d.code.starts_with("limit-")) return;
  const std::string form = written_form(group, word);
  if (!form.empty())
    d.hint = "the form is `" + form + "`";
  else if (d.code == "missing-argument")
    d.hint = "add the missing argument; the card ends too early";
}

std::vector<GrammarArgument> grammar_arguments(const std::string& text) {
  std::vector<GrammarArgument> arguments;
  std::set<std::string> seen;
  for (std::size_t at = text.find('<'); at != text.npos; at = text.find('<', at + 1)) {
    const std::size_t end = text.find('>', at);
    const std::string inside = text.substr(at + 1, end - at - 1);
    const std::size_t unit = inside.find(" [");
    if (unit == inside.npos || !seen.insert(inside).second) continue;
    arguments.push_back(
        {inside.substr(0, unit), inside.substr(unit + 2, inside.size() - unit - 3)});
  }
  return arguments;
}

}  // namespace mbcosim
