/// What can be said about a model only when all of its deck is read.
#pragma once

#include "input/reading.h"
#include "model/model.h"

namespace mbcosim {

/// Reports hydraulic nodes on which no equation depends, modal nodes without a modal joint (both
/// errors) and pressures that jump at the start (warnings).
void check_model(Reading& reading, const Model& model);

}  // namespace mbcosim
