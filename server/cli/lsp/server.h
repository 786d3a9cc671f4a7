/// A language server for decks (Language Server Protocol 3.17): diagnostics as the reader finds
/// them, completion, hover, definitions and references.
#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "cli/lsp/document.h"
#include "cli/lsp/wire.h"
#include "input/vocabulary.h"
#include "simulation/load.h"

namespace mbcosim::lsp {

class Server {
 public:
  explicit Server(Wire& wire);
  /// Serves until the editor leaves; the exit code of the protocol: 0 after `shutdown`, else 1.
  int run();

 private:
  struct Entry {
    Document document;
    std::vector<DeckSymbol> symbols;  ///< of the last reading that went well
  };

  void dispatch(const Json& message);
  Json answer(const std::string& method, const Json& parameters);
  void note(const std::string& method, const Json& parameters);
  void change(const std::string& uri, std::string text);

  void check_changed();
  void check(const std::string& uri);
  void publish(const std::string& uri, const std::vector<Diagnostic>& diagnostics);

  Json complete(const Entry& entry, std::size_t offset) const;
  Json hover(const Entry& entry, std::size_t offset) const;
  Json definitions(const std::string& uri, std::size_t offset) const;
  Json references(const std::string& uri, std::size_t offset) const;

  Wire& wire_;
  std::vector<VocabularyGroup> words_;
  std::map<std::string, Entry> open_;                      ///< by URI
  std::map<std::string, std::set<std::string>> shown_in_;  ///< files with diagnostics, by deck
  std::set<std::string> changed_;
  bool initialized_ = false, shut_down_ = false, left_ = false;
};

}  // namespace mbcosim::lsp
