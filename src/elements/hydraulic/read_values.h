/// What the readers of hydraulic elements share.
#pragma once

#include <string>

#include "elements/hydraulic/hydraulic_laws.h"
#include "model/card.h"

namespace mbcosim::hydraulic {

/// A real above machine epsilon; refused otherwise. `what` with its article-free name: "pipe
/// diameter".
double read_positive(Card& card, const std::string& what);
/// A real >= 0.
double read_non_negative(Card& card, const std::string& what);
/// Indices of `count` hydraulic nodes; warns when two are equal, since their contributions cancel.
template <int count>
struct Nodes {
  int index[count];
};
void warn_repeated_nodes(Card& card, const int* index, int count);
template <int count>
Nodes<count> read_nodes(Card& card) {
  Nodes<count> nodes;
  for (int& index : nodes.index) index = card.scalar_node(ScalarKind::hydraulic);
  warn_repeated_nodes(card, nodes.index, count);
  return nodes;
}
/// `<cs>, <cv>, <ca>` of stops at both ends of the stroke lo..hi.
EndStops read_end_stops(Card& card, double lo, double hi);
/// Pressure written on the node's card [Pa]. Clamps do not change it.
double declared_pressure(Card& card, int node);

}  // namespace mbcosim::hydraulic
