#include "elements/read_number.h"

#include <cmath>
#include <string>

namespace mbcosim {

double read_positive(Card& card, const char* what) {
  const double value = card.real(what);
  if (!(value > 0) || !std::isfinite(value))
    card.fail(std::string("the ") + what + " must be positive, got " + std::to_string(value));
  return value;
}

}  // namespace mbcosim
