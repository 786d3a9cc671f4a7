#include "elements/hydraulic/read_values.h"

#include <cstdio>
#include <limits>

#include "model/model.h"

namespace mbcosim::hydraulic {
namespace {

std::string got(double value) {
  char text[40];
  std::snprintf(text, sizeof text, ", got %g", value);
  return text;
}

}  // namespace

double read_positive(Card& card, const std::string& what) {
  const double value = card.real(what);
  if (!(value > std::numeric_limits<double>::epsilon()))
    card.fail(what + " must be positive" + got(value));
  return value;
}

double read_non_negative(Card& card, const std::string& what) {
  const double value = card.real(what);
  if (!(value >= 0)) card.fail(what + " must not be negative" + got(value));
  return value;
}

void warn_repeated_nodes(Card& card, const int* index, int count) {
  for (int i = 0; i < count; ++i)
    for (int j = 0; j < i; ++j)
      if (index[i] == index[j]) {
        card.warn("hydraulic node " + std::to_string(card.model().scalars[index[i]].label) +
                  " is used twice: the flows between its two ends cancel");
        return;
      }
}

EndStops read_end_stops(Card& card, double lo, double hi) {
  EndStops stops;
  stops.cs = card.real("stiffness of the end stops");
  stops.cv = card.real("damping of the end stops");
  stops.ca = card.real("mass of the end stops");
  stops.lo = lo;
  stops.hi = hi;
  return stops;
}

double declared_pressure(Card& card, int node) { return card.model().scalars[node].value; }

}  // namespace mbcosim::hydraulic
