/// What the cards of external forces have in common.
#pragma once

#include <string>

#include "model/card.h"
#include "model/structural_port.h"

namespace mbcosim {

/// `grpc, port, "name"`, or the words of a socket, which are read and left: then the port is named
/// "external<label>". Refuses names that are taken.
std::string read_port_name(Card& card, int label);
/// `[sleep time, …] [precision, …] [coupling, …] [send after predict, …]`
PortCoupling read_port_timing(Card& card);
/// `[reference node, …] … [use reference node forces, …]`
void read_port_options(Card& card, StructuralPort& port);

}  // namespace mbcosim
