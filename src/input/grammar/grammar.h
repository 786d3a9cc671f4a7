/// How each word of the language is written: the one place that `mbcosim keywords --json`, the
/// feature tables and the editor take it from.
///
///     @ joint | joint : <label> , <word> , <grammar> ;        a group and the form of its
///     statements clamp                                                   a word
///       : gravity : <grammar> ;                               form of its own
///       = <node> , [ position , ] { node | <position> }       what stands after it
///       > .jnt: F [N] (3)                                     what it writes
///       ! partly: without friction                            yes | partly | ignored | no | not
///       yet
///
/// A word stands for itself; `<n steps>` is a whole number, `<mass [kg]>` a number with its unit,
/// `"<file>"` a text; names of the group `notation` stand for what is written there, a number
/// behind them for another one (`<node 2>`). `[ … ]` may be left out, of `{ a | b }` one is
/// written,
/// `( … ) * n points` is repeated, with commas, as often as the number of that name says. A test
/// writes sentences by the grammar and has the reader read them.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "model/diagnostic.h"

namespace mbcosim {

struct WordGrammar {
  std::string word;     ///< as written in documentation
  std::string form;     ///< of its statements; empty: that of the group
  std::string text;     ///< what stands after the word
  std::string output;   ///< columns, with units
  std::string support;  ///< empty: `yes`
  std::string note;     ///< on the support
};

struct GroupGrammar {
  std::string form;                          ///< of the statements
  std::map<std::string, WordGrammar> words;  ///< by normalized word
  std::vector<std::string> written;          ///< words in the order and spelling of the text
};

/// By name of the group.
const std::map<std::string, GroupGrammar>& grammars();
/// Null when there is none.
const WordGrammar* find_grammar(std::string_view group, std::string_view word);

/// Is it a word of any group?
bool is_word_of_language(std::string_view word);

/// How a word of a group is written, with what stands around it; empty when there is no grammar of
/// it. What is longer than a few lines of a terminal ends with "…".
std::string written_form(std::string_view group, std::string_view word);
/// The form as the hint of an error about a card that has none.
void add_form(Diagnostic& d, std::string_view group, std::string_view word);

/// A number of which a grammar tells the unit: `<mass [kg]>`.
struct GrammarArgument {
  std::string name, unit;
};
std::vector<GrammarArgument> grammar_arguments(const std::string& text);

}  // namespace mbcosim
