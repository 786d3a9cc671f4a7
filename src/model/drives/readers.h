/// Readers of the drives by kind; `register_drives` calls them all.
#pragma once

#include <limits>

#include "model/card.h"
#include "model/registry.h"

namespace mbcosim {

void register_closed_form_drives(Registry& registry);
void register_composed_drives(Registry& registry);
void register_step_driven_drives(Registry& registry);
void register_file_drivers(Registry& registry);

/// `forever` (infinity) or an instant.
inline double read_end(Card& card) {
  return card.keyword("forever") ? std::numeric_limits<double>::infinity()
                                 : card.real("final time");
}

/// A count of at least `least`.
inline int read_count(Card& card, const char* what, int least = 1) {
  const int n = card.integer(what);
  if (n < least)
    card.fail(std::string(what) + " must be at least " + std::to_string(least) + ", got " +
              std::to_string(n));
  return n;
}

}  // namespace mbcosim
