/// Old names of total joints: `imposed displacement`, `imposed displacement pin`, `imposed
/// orientation`.
#pragma once

#include "model/card.h"
#include "model/element_set.h"

namespace mbcosim {

/// `<n1> , <f1> , <n2> , <f2> , <direction> , <drive>`: a total joint that imposes all three
/// components of the relative position, in the frame of node 1, as direction times drive. (MBDyn's
/// manual speaks of the one component along the direction; MBDyn constrains all three.)
void read_imposed_displacement(Card& card, ElementInfo& info);
/// `<n> , <f> , <X> , <direction> , <drive>`: a total pin joint, likewise, in the global frame.
void read_imposed_displacement_pin(Card& card, ElementInfo& info);
/// `<n1> , <R1h> , <n2> , <R2h> , <direction> , <drive>`: a total joint that imposes the relative
/// rotation vector.
void read_imposed_orientation(Card& card, ElementInfo& info);

}  // namespace mbcosim
