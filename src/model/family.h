/// Families of elements: what each is called wherever a deck, a result file or a client names it.
#pragma once

#include <array>
#include <span>
#include <string_view>

namespace mbcosim {

/// Families that share a label space, in the order in which their unknowns are numbered, after
/// those of the nodes.
enum class Family {
  joint,
  joint_regularization,
  plate,
  genel,
  induced_velocity,
  aerodynamic,
  aeromodal,
  electric,
  thermal,
  hydraulic,
  loadable,
  // families without unknowns of their own
  body,
  beam,
  force,
  gravity,
  inertia,
  automatic_structural,
  air_properties,
  bulk,
  output_element,
  count
};
inline constexpr int kFamilies = static_cast<int>(Family::count);

/// The order of families between which sums are passed on, within each stage of a step (after the
/// prediction, accumulation, after convergence): all `contributors` come before all `collectors`.
/// Within one rank elements keep the order of their sets.
enum class StageRank { contributor, collector };

/// A head of the elements block whose elements are of types: `joint: <label>, <type>, ...`.
struct TypedHead {
  const char* head;   ///< normalized
  const char* title;  ///< of the table of its types: "Joints"
};

struct FamilyFacts {
  Family family;
  const char* name;            ///< in messages and private data: "joint"
  const char* plural;          ///< in messages: "rigid bodies"
  const char* count_card;      ///< of the control data; empty: none
  const char* old_count_card;  ///< normalized name that older decks use; empty: none
  /// Normalized heads of the elements block that count as this family, served or not.
  std::span<const std::string_view> heads;
  /// Normalized words of model functions: `model::joint(…)`.
  std::span<const std::string_view> functions;
  std::span<const TypedHead> typed = {};
  /// Extensions of the family's result files, and what their variables in NetCDF begin with:
  /// "elem.<owner>.<label>.". Empty for families that write none.
  std::span<const std::string_view> files = {};
  const char* owner = "";
  bool has_default_output = true;  ///< `default output` knows the family
  bool has_label = true;
  StageRank rank = StageRank::contributor;
};

const FamilyFacts& family_facts(Family family);
std::span<const FamilyFacts> all_families();
inline const char* family_name(Family family) { return family_facts(family).name; }

/// By a normalized head of the elements block, or nullptr.
const FamilyFacts* family_by_head(std::string_view head);
/// By a normalized word of a model function, or nullptr.
const FamilyFacts* family_by_function(std::string_view word);
/// By the extension of a result file, or nullptr.
const FamilyFacts* family_by_file(std::string_view extension);

}  // namespace mbcosim
