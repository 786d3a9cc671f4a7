#include <cctype>
#include <ostream>

#include "elements/families.h"
#include "elements/modal/fem_data.h"
#include "elements/modal_bodies.h"
#include "word_cards.h"

namespace mbcosim::decks {
namespace {

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != text.npos;
}

std::string nodes_of(const std::string& cards) {
  std::string text =
      "structural: 1, dynamic, .1,.2,.3, euler, .3,-.2,.4, .5,.6,-.7, .8,.3,-.2;"
      "structural: 2, dynamic, 1.,-.3,.2, euler, -.1,.5,.2, -.4,.2,.1, .1,-.6,.3;"
      "structural: 3, dynamic, 2.1,.4,-.3, euler, .2,.1,-.3, .1,.2,.3, .2,.1,.4;"
      "structural: 5, dynamic displacement, .3,.1,2., .1,.2,.3;"
      "structural: 6, static displacement, 1.3,-.1,1., .3,.1,.2;";
  if (contains(cards, "generic.fem"))
    text += "structural: 7, modal, .2,.1,.3, euler, .1,.3,.2, .1,.2,.3, .3,.2,.1;";
  if (contains(cards, "beam slider"))
    text +=
        "structural: 8, dynamic, 1.030507,-0.192770,0.287012, euler, .2,.3,-.1, "
        "-0.484376,0.200451,0.129027, .1,.4,.2;";
  for (int label = 11; label <= 16; ++label)
    text += "abstract: " + std::to_string(label) + ", differential;";
  text += "electric: 21; electric: 22;";
  for (int label = 31; label <= 36; ++label)
    if (contains(cards, " " + std::to_string(label) + ","))
      text += "hydraulic: " + std::to_string(label) + ", 1." + std::to_string(label) + "e5;";
  if (contains(cards, "thermal")) text += "thermal: 41, value, 3.; thermal: 42, value, 5.;";
  return text;
}

/// Masses, capacities and springs of the nodes; hydraulic nodes keep their pressures.
std::string supports_of(const std::string& cards) {
  std::string text;
  for (const int node : {1, 2, 3, 8})
    if (node != 8 || contains(cards, "beam slider"))
      text += "body: " + std::to_string(node) + ", " + std::to_string(node) +
              ", 1.5, .1,.05,.02, diag, .3,.4,.5;";
  text += "body: 5, 5, 1.2;";
  const auto scalar = [&](int label, const std::string& rest) {
    text += "genel: " + std::to_string(label) + rest + ";";
  };
  for (int dof = 1; dof <= 3; ++dof)
    scalar(dof, ", spring support, 6, structural, " + std::to_string(dof) +
                    ", algebraic, linear viscoelastic, 3., 20.");
  for (int label = 11; label <= 16; ++label)
    scalar(label, ", spring support, " + std::to_string(label) +
                      ", abstract, algebraic, linear viscoelastic, 3., 2.");
  for (int label = 21; label <= 22; ++label)
    scalar(label, ", spring support, " + std::to_string(label) +
                      ", electric, algebraic, linear viscoelastic, 3., 2.");
  for (int label = 31; label <= 36; ++label)
    if (contains(cards, " " + std::to_string(label) + ","))
      scalar(label, ", clamp, " + std::to_string(label) + ", hydraulic, const, 1." +
                        std::to_string(label) + "e5");
  if (contains(cards, "thermal"))
    text += "thermal: 41, capacitance, 41, 2.; thermal: 42, capacitance, 42, 3.;";
  return text;
}

std::string drivers_of(const WordCard& word) {
  std::string text;
  if (word.driver) text = "\n" + word.card + ";\n";
  if (contains(word.card, "file, 82")) text += "file: 82, variable step, 2, \"variable\";";
  return text.empty() ? text : "begin: drivers;" + text + "end: drivers;";
}

}  // namespace

void PrintTo(const WordCard& card, std::ostream* out) { *out << card.card; }

std::vector<WordCard> word_cards() {
  std::vector<WordCard> all;
  for (const auto& cards : {element_cards(), drive_cards(), law_cards(), function_cards(),
                            fluid_cards(), file_driver_cards()})
    all.insert(all.end(), cards.begin(), cards.end());
  return all;
}

std::vector<WordCard> numbered_word_cards() {
  std::map<std::string, int> seen;
  std::vector<WordCard> all = word_cards();
  for (WordCard& card : all) card.word += " " + std::to_string(++seen[card.word]);
  return all;
}

std::set<std::string> registered_words() {
  const Registry& registry = full_registry();
  std::set<std::string> words;
  const auto add = [&](const std::string& group, const auto& readers) {
    for (const auto& entry : readers) words.insert(group + ":" + entry.key);
  };
  for (const auto& [head, entry] : registry.heads) {
    if (entry.types.empty()) words.insert(head);
    add(head, entry.types);
  }
  add("drive", registry.drives);
  add("law1", registry.laws1);
  add("law3", registry.laws3);
  add("law6", registry.laws6);
  add("function", registry.functions);
  add("fluid", registry.fluids);
  add("filedriver", registry.file_drivers);
  return words;
}

std::string test_name(const WordCard& card) {
  std::string name;
  for (const char c : card.word) name += std::isalnum(static_cast<unsigned char>(c)) ? c : '_';
  return name;
}

std::vector<std::string> arguments(const std::string& card) {
  std::vector<std::string> parts(1);
  bool quoted = false;
  for (const char ch : card) {
    if (ch == '"') quoted = !quoted;
    if (ch == ',' && !quoted)
      parts.emplace_back();
    else if (ch != ' ' || !parts.back().empty())
      parts.back() += ch;
  }
  return parts;
}

std::string joined(const std::vector<std::string>& parts) {
  std::string text = parts[0];
  for (std::size_t k = 1; k < parts.size(); ++k) text += ", " + parts[k];
  return text;
}

std::map<std::string, std::string> word_deck(const WordCard& word, Bench bench) {
  static const std::string modal_body = write_fem_text(generic_body(), {});
  const bool moving = bench == Bench::moving, replaced = moving && !word.solvable.empty();
  std::string cards = word.before;
  if (!word.driver) cards += "\n" + word.card + ";\n";
  cards += word.after;
  if (replaced) cards = word.solvable;
  // Laws alone constrain nothing; what is replaced fits as it is.
  const bool assembled = moving && !replaced && word.word.rfind("law", 0) != 0;
  const std::string deck =
      "begin: data; problem: initial value; end: data;"
      "begin: initial value; initial time: 0.; final time: 1.; time step: 1e-3; max iterations: "
      "50; tolerance: 1e-6; derivatives tolerance: 1e9; end: "
      "initial value; begin: control data;" +
      std::string(assembled ? "max initial iterations: 50;" : "skip initial joint assembly;") +
      "end: control data; begin: nodes;" + nodes_of(cards) + "end: nodes;" + drivers_of(word) +
      "begin: elements;" + cards + (moving ? supports_of(cards) : "") + "end: elements;\n";
  return {{"deck.mbd", deck},
          {"gains", "1. 2.\n"},
          {"modes", "1 2 1.\n"},
          {"points", "1 1 1.\n2 2 1.\n3 6 .5\n"},
          {"fixed", "1. 2.\n3. 5.\n2. 7.\n"},
          {"variable", "0. 1. 2.\n.002 3. 5.\n.1 2. 7.\n"},
          {"generic.fem", modal_body}};
}

}  // namespace mbcosim::decks
