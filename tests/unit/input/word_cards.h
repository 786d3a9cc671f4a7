/// One card of every word of the registry, and decks around it. Whoever needs something of every
/// word (derivatives, snapshots, refusals of bad arguments) takes them from here.
#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

namespace mbcosim::decks {

struct WordCard {
  std::string word;  ///< "joint: clamp", "body", "drive: ramp", "law 3: linear elastic"
  std::string before, card, after;  ///< other cards, the one with the word (no ";"), other cards
  bool driver = false;              ///< the card stands in the block of drivers
  std::string solvable;  ///< in place of all these cards where steps are solved; empty: none
};
void PrintTo(const WordCard& card, std::ostream* out);

/// Nodes of all cards: 1–3 dynamic, 5 and 6 without rotation, 7 modal, 8 a slider; 11–16 abstract;
/// 21, 22 electric; 31–36 hydraulic; 41, 42 thermal.
std::vector<WordCard> element_cards();
std::vector<WordCard> drive_cards();
std::vector<WordCard> law_cards();  ///< some words several times
std::vector<WordCard> function_cards();
std::vector<WordCard> fluid_cards();
std::vector<WordCard> file_driver_cards();
std::vector<WordCard> word_cards();           ///< all of them
std::vector<WordCard> numbered_word_cards();  ///< and each word with a number: "drive: ramp 1"

/// The registry's words in the form of WordCard::word, normalized.
std::set<std::string> registered_words();
/// Letters and digits of a word, for the names of tests.
std::string test_name(const WordCard& card);

/// The arguments of a card, without blanks at their beginning; the first has the head. Commas in
/// strings separate nothing.
std::vector<std::string> arguments(const std::string& card);
/// A card of arguments.
std::string joined(const std::vector<std::string>& arguments);

enum class Bench {
  bare,   ///< nodes without masses, no assembly: to evaluate the word's own equations
  moving  ///< every node carries something, so that steps can be solved
};
/// The files of a deck, "deck.mbd" the first of them, in which `card` stands on a line of its own.
std::map<std::string, std::string> word_deck(const WordCard& word, Bench bench);

}  // namespace mbcosim::decks
