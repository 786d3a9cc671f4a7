/// Decks as text inside tests: read with a registry of one's own or with the full one.
#pragma once

#include <gtest/gtest.h>

#include <map>
#include <string>
#include <vector>

#include "input/deck_reader.h"
#include "model/card.h"
#include "simulation/simulation.h"

namespace mbcosim::decks {

/// The four blocks around the given cards.
struct DeckText {
  std::string initial_value = "", control = "", nodes = "", elements = "", before = "";
  std::string text() const {
    return before + "begin: data; problem: initial value; end: data;\nbegin: initial value;\n" +
           initial_value + "\nend: initial value;\nbegin: control data;\n" + control +
           "\nend: control data;\nbegin: nodes;\n" + nodes + "\nend: nodes;\nbegin: elements;\n" +
           elements + "\nend: elements;\n";
  }
};

inline LoadReport load(const std::string& text, std::map<std::string, std::string> others = {}) {
  others["deck.mbd"] = text;
  return load_deck(BundleSource(std::move(others)), "deck.mbd");
}
inline LoadReport load(const DeckText& deck) { return load(deck.text()); }

/// "error: message" of every diagnostic but notes, one a line.
inline std::string findings(const std::vector<Diagnostic>& diagnostics) {
  std::string text;
  for (const Diagnostic& d : diagnostics) {
    if (d.severity == Severity::note) continue;
    text += std::string(text.empty() ? "" : "\n") +
            (d.severity == Severity::error ? "error: " : "warning: ") + d.message;
  }
  return text;
}

/// Loads a deck that must be accepted.
inline ModelPtr model_of(const std::string& text) {
  const LoadReport report = load(text);
  EXPECT_TRUE(report.ok()) << findings(report.diagnostics);
  return report.model;
}
inline ModelPtr model_of(const DeckText& deck) { return model_of(deck.text()); }

/// Calls `read` with the arguments of a card `probe: ...` in the elements block of `deck`.
inline std::string probe(DeckText deck, const std::string& arguments,
                         const std::function<void(Card&)>& read) {
  Registry registry;
  registry.element("probe", Family::loadable, [&](Card& card, ElementInfo&) { read(card); });
  deck.elements += "probe: 1, " + arguments + ";";
  const BundleSource files({{"deck.mbd", deck.text()}});
  ModelBuilder builder;
  Reading reading(files, Limits{}, &builder);
  EXPECT_TRUE(reading.open_file("deck.mbd"));
  Deck state(reading, builder, registry);
  Statements statements(reading);
  DeckReader(state, statements).read();
  return findings(reading.diagnostics());
}

}  // namespace mbcosim::decks
