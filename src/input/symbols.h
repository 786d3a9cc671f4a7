/// Variables and constants of the deck: one flat table for the whole run,
/// scopes for loop passes only.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "input/value.h"
#include "model/diagnostic.h"
#include "model/fwd.h"

namespace mbcosim {

/// Values that take the place of those in the deck's first declarations, by name.
using SymbolValues = std::map<std::string, Value, std::less<>>;

/// Variables that the run updates; run-time strings read them from the EvalContext.
enum class SymbolRole : std::uint8_t { plain, time, time_step, step, var };

struct Symbol {
  std::string name;
  Value value;  ///< its alternative is the declared type
  bool constant = false;
  bool predefined = false;  ///< `pi`, `TRUE`, ...
  bool overridden = false;  ///< its declaration took the value that the user gave
  bool damaged =
      false;  ///< its value could not be computed: errors that follow from it are not reported
  SymbolRole role = SymbolRole::plain;
  int scope = 0;                  ///< 0: whole deck; n: a pass of the n-th enclosing loop
  int variable = -1;              ///< index in State::variables when a run-time string assigns it
  SourceSpan where;               ///< of its declaration
  std::optional<Value> declared;  ///< what its declaration gave it
  DrivePtr plugin;                ///< plugin variable: fetches the value at each use
};

class SymbolTable {
 public:
  SymbolTable();  ///< with the predefined constants

  Symbol* find(std::string_view name);
  const Symbol* find(std::string_view name) const {
    return const_cast<SymbolTable*>(this)->find(name);
  }
  /// Adds a symbol in the innermost scope; the name must be new.
  Symbol& declare(Symbol symbol);
  void open_scope();
  void close_scope();  ///< forgets what was declared since `open_scope`
  int depth() const { return static_cast<int>(scopes_.size()); }
  std::vector<const Symbol*> sorted() const;  ///< by bytes of the name
  /// Known names nearest to `name` (case slips, few typing errors); empty when there is none.
  std::string nearest(std::string_view name) const;

 private:
  std::deque<Symbol> symbols_;                           // stable addresses
  std::unordered_map<std::string_view, Symbol*> index_;  // keys live in symbols_
  std::vector<std::vector<Symbol*>> scopes_;
  std::vector<Symbol*> unused_;  // slots of closed scopes
};

}  // namespace mbcosim
