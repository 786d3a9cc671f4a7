/// Reads a deck without blocks and keeps what it said.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "input/reading.h"
#include "input/statements.h"
#include "model/model.h"

namespace mbcosim {

struct Calculation {
  std::vector<std::string> lines;     ///< what was printed, without "line n, file <...>: "
  std::vector<std::string> messages;  ///< "3:9: error: ..." in the order of the deck
  std::vector<std::string> full;      ///< complete texts of the diagnostics
  std::vector<std::string> cards;  ///< words of the statements that are not cards of the calculator
};

inline Calculation calculate(const std::string& deck, std::map<std::string, std::string> files = {},
                             Limits limits = {}, bool with_model = false,
                             ReaderOptions options = {}) {
  files["deck.mbd"] = deck;
  const BundleSource source(std::move(files));
  ModelBuilder builder;
  Reading reading(source, limits, with_model ? &builder : nullptr, options);
  if (with_model) reading.start_run_variables(0);
  Calculation r;
  (void)reading.open_file("deck.mbd");
  Statements statements(reading);
  while (const auto s = statements.next()) r.cards.push_back(s->word);
  for (const Diagnostic& d : reading.diagnostics()) {
    const char* severity = d.severity == Severity::error ? "error" : "warning";
    const std::string file = d.file == "deck.mbd" ? "" : d.file + ":";
    r.messages.push_back(file + std::to_string(d.line) + ":" + std::to_string(d.column) + ": " +
                         severity + ": " + d.message);
    r.full.push_back(d.text());
  }
  std::size_t at = 0;
  while (at < reading.printed.size()) {
    const std::size_t end = reading.printed.find('\n', at);
    std::string line = reading.printed.substr(at, end - at);
    const std::size_t text = line.find(">: ");
    if (line.rfind("line ", 0) == 0 && text != std::string::npos) line = line.substr(text + 3);
    r.lines.push_back(line);
    at = end + 1;
  }
  return r;
}

}  // namespace mbcosim
