/// Units of the private data of elements.
#pragma once

#include <string>
#include <string_view>

#include "model/element_set.h"

namespace mbcosim {

/// SI unit of an element's private datum: "N" of "Fx", "m" of "pI.Xx"; empty when it has none, or
/// one that depends on what the deck attaches to the element.
std::string unit_of_datum(Family family, std::string_view name);

}  // namespace mbcosim
