/// Which keyword makes what. Filled once by `register_elements` and its like; used by the deck
/// reader.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "model/element_set.h"
#include "model/fwd.h"

namespace mbcosim {

/// Keywords are stored without blanks and in lower case, as the language compares them.
std::string normalized(std::string_view word);

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
    Family family;
    bool has_label = true;
    ElementReader reader;                        ///< for heads without types
    std::map<std::string, ElementReader> types;  ///< normalized type word -> reader
  };

  /// `words` lists synonyms, e.g. {"revolute hinge", "plane hinge"}; the first is the name used in
  /// messages.
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

  std::map<std::string, Head> heads;
  std::map<std::string, DriveReader> drives;
  std::map<std::string, LawReader<1>> laws1;
  std::map<std::string, LawReader<3>> laws3;
  std::map<std::string, LawReader<6>> laws6;
  std::map<std::string, FunctionReader> functions;
  std::map<std::string, FluidReader> fluids;
  std::map<std::string, FileDriverReader> file_drivers;  ///< "fixedstep", "variablestep", ...
  /// context ("elements", "joint", "force", "drive", "law", ...) -> normalized word -> what it is.
  std::map<std::string, std::map<std::string, std::string>> not_supported;
  /// normalized word -> words as written in documentation, for messages and the editor grammar.
  std::map<std::string, std::string> display;
};

}  // namespace mbcosim

namespace mbcosim {

void register_drives(
    Registry& registry);  ///< drives and scalar functions (model/drives, model/functions)
void register_laws(Registry& registry);    ///< constitutive laws (model/laws)
void register_fluids(Registry& registry);  ///< hydraulic fluids (model/fluids)

}  // namespace mbcosim
