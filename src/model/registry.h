/// Which keyword makes what. Filled once by `register_elements` and its like; used by the deck
/// reader.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <string_view>

#include "model/element_set.h"
#include "model/fwd.h"
#include "model/word_table.h"

namespace mbcosim {

class Registry {
 public:
  using ElementReader = std::function<void(Card&, ElementInfo&)>;
  using DriveReader = std::function<DrivePtr(Card&)>;
  template <int N>
  using LawReader = std::function<LawPtr<N>(Card&)>;
  using FunctionReader = std::function<ScalarFunctionPtr(Card&)>;
  using FluidReader = std::function<FluidPtr(Card&)>;
  /// Reads what follows the type word of a `file` card of the drivers block.
  using FileDriverReader = std::function<FileDriverPtr(Card&, int label)>;

  /// A statement head of the elements block: `body`, `beam3`, `gravity`, or a family with types:
  /// `joint`, `force`.
  struct Head {
    std::string_view word;  ///< as written in documentation
    Family family;
    bool has_label = true;
    ElementReader reader;            ///< for heads without types
    WordTable<ElementReader> types;  ///< of the others
  };

  /// Words are literals. `words` lists synonyms, e.g. {"revolute hinge", "plane hinge"}.
  void element(std::string_view head, Family family, ElementReader reader, bool has_label = true);
  void typed(std::string_view head, Family family, std::initializer_list<std::string_view> words,
             ElementReader reader);
  void drive(std::initializer_list<std::string_view> words, DriveReader reader);
  void law1(std::initializer_list<std::string_view> words, LawReader<1> reader);
  void law3(std::initializer_list<std::string_view> words, LawReader<3> reader);
  void law6(std::initializer_list<std::string_view> words, LawReader<6> reader);
  void function(std::initializer_list<std::string_view> words, FunctionReader reader);
  void fluid(std::initializer_list<std::string_view> words, FluidReader reader);
  void file_driver(std::initializer_list<std::string_view> words, FileDriverReader reader);
  /// A keyword of the language that this program does not serve; refused by name: "`rotor`
  /// (aerodynamic element) ...".
  void unsupported(std::string_view context, std::string_view word, std::string_view what);

  std::map<std::string, Head, std::less<>> heads;  ///< by normalized word
  WordTable<DriveReader> drives;
  WordTable<LawReader<1>> laws1;
  WordTable<LawReader<3>> laws3;
  WordTable<LawReader<6>> laws6;
  WordTable<FunctionReader> functions;
  WordTable<FluidReader> fluids;
  WordTable<FileDriverReader> file_drivers;  ///< "fixed step", "variable step", ...
  /// What words are that are not served, by context: "elements", "joint", "force", "drive", ...
  std::map<std::string, WordTable<std::string_view>, std::less<>> not_supported;

 private:
  Head& head(std::string_view word, Family family);
};

}  // namespace mbcosim

namespace mbcosim {

void register_drives(
    Registry& registry);  ///< drives and scalar functions (model/drives, model/functions)
void register_laws(Registry& registry);    ///< constitutive laws (model/laws)
void register_fluids(Registry& registry);  ///< hydraulic fluids (model/fluids)

}  // namespace mbcosim
