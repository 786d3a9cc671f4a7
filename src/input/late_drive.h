/// Drives whose numbers are known only during the run: those inside the hints of `driven`.
#pragma once

#include <string_view>
#include <vector>

#include "model/drive.h"
#include "model/element_set.h"

namespace mbcosim {

class DeckCard;

/// Reads a drive whose numbers are expressions. Each is sampled (into `samples`) when the element
/// becomes active; the drive is then made anew from these numbers.
DrivePtr read_late_drive(DeckCard& card, std::string_view what, std::vector<HintSample>& samples);
/// The same for a vector drive: `null`, `single`, `array`, `component` or a bare vector; its
/// entities are three numbers each.
Vec3DrivePtr read_late_vec3_drive(DeckCard& card, std::string_view what,
                                  std::vector<HintSample>& samples);

}  // namespace mbcosim
