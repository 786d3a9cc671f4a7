/// Which quantities of a beam's evaluation points go to self-describing formats.
#pragma once

#include <optional>
#include <string_view>

#include "math/rotation.h"
#include "model/fwd.h"

namespace mbcosim {

/// What `custom output` of a beam or `default beam output` chooses. The lines of .act have forces
/// and moments whatever is chosen.
struct BeamOutput {
  enum Field : unsigned {
    position = 1,
    orientation = 2,
    force = 4,
    moment = 8,
    strain = 16,
    curvature = 32,
    strain_rate = 64,
    curvature_rate = 128,
    rates = strain_rate | curvature_rate,
    every = 255
  };
  unsigned chosen = force | moment;
  std::optional<OrientationDescription> description;  ///< nothing: `default orientation`
};

/// A card that knows the choice of `default beam output` derives from this besides Card; the reader
/// of beams asks for it by dynamic_cast.
class BeamOutputDefault {
 public:
  virtual ~BeamOutputDefault() = default;
  virtual BeamOutput default_beam_output() const = 0;
};

/// Reads the flags that stand next in the card, at least one. `what`: "custom output", for
/// messages. Elastic beams have no rates: asking for them by name is a warning.
BeamOutput read_beam_output(Card& card, std::string_view what, bool viscoelastic);

}  // namespace mbcosim
