/// What the reader of a deck knows besides the model: named objects with their places, counts,
/// output defaults.
#pragma once

#include <array>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <unordered_map>

#include "input/counts.h"
#include "input/reading.h"
#include "math/hash.h"
#include "model/beam_output.h"
#include "model/model.h"
#include "model/registry.h"

namespace mbcosim {

class DeckCard;

template <class T>
using LabelMap = std::unordered_map<int, Named<T>>;

/// "joint 3 is not defined"
std::string undefined_text(const std::string& kind, int label);

/// Which entities write results when their card does not say (`default output`).
struct OutputDefaults {
  bool structural = true, accelerations = false;
  std::array<bool, 5> scalar;  ///< by ScalarKind
  std::array<bool, kFamilies> family;
  OutputDefaults() {
    scalar.fill(true);
    family.fill(true);
    family[static_cast<int>(Family::gravity)] = false;
  }
};

struct Deck {
  Deck(Reading& s, ModelBuilder& b, const Registry& r) : reading(s), builder(b), registry(r) {
    scalar_scale.fill(1);
  }

  Reading& reading;
  ModelBuilder& builder;
  const Registry& registry;

  Counts counts;
  Digest data_files;  ///< of the files that cards read whole
  OutputDefaults output;
  BeamOutput beam_output;              ///< `default beam output`
  double structural_scale = 1;         ///< `default scale` of nodes
  std::array<double, 5> scalar_scale;  ///< by ScalarKind
  bool method_set = false;
  SourceSpan method_where;
  SourceSpan final_time_where, strategy_where;
  bool output_rate_set = false;   ///< by `output frequency` or `output meter`
  bool inverse_dynamics = false;  ///< is it the problem?

  std::unordered_map<int, std::size_t> frames;  ///< label -> index in Model::frames
  std::unordered_map<int, Weight> dummy_nodes;
  LabelMap<DrivePtr> drives;
  std::vector<int> drives_without_output;  ///< indices in Model::drives whose card does not
                                           ///< tell whether the value is written
  LabelMap<LawPtr<1>> laws1;
  LabelMap<LawPtr<3>> laws3;
  LabelMap<LawPtr<6>> laws6;
  LabelMap<DrivePtr> drives1;
  LabelMap<TplDrivePtr<3>> drives3;
  LabelMap<TplDrivePtr<6>> drives6;
  LabelMap<TplDrivePtr<3, 3>> drives33;
  LabelMap<TplDrivePtr<6, 6>> drives66;
  LabelMap<FluidPtr> fluids;
  LabelMap<bool> c81_data;
  LabelMap<FileDriverPtr> file_drivers;
  std::set<int> bound_parameters;  ///< indices of parameter nodes that a `bind` card feeds

  /// Labels whose definition was refused: errors that follow from them are not reported.
  std::map<std::string, std::set<int>, std::less<>> damaged;
  std::set<std::string, std::less<>> damaged_kinds;  ///< a definition without a readable label
  void damage(const std::string& kind, int label);
  /// Was the definition of this entity, or one of its kind without a readable label, refused?
  bool was_refused(const std::string& kind, int label) const;
  /// Was any of the kind?
  bool any_was_refused(std::string_view kind) const;
  [[noreturn]] void redefined(DeckCard& card, std::string_view kind, int label, SourceSpan before);

  /// Counts one more entity of `kind`; refused when it is more than the deck declared.
  void count_entity(DeckCard& card, Kind kind, int label);
};

}  // namespace mbcosim
