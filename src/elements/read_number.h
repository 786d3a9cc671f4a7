/// Numbers with bounds, for readers of elements.
#pragma once

#include "model/card.h"

namespace mbcosim {

/// A finite number > 0. Fails the card: "the WHAT must be positive, got …".
double read_positive(Card& card, const char* what);

}  // namespace mbcosim
