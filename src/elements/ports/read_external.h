/// What the cards of external forces have in common.
#pragma once

#include <string>

#include "model/card.h"
#include "model/deck_channel.h"
#include "model/structural_port.h"

namespace mbcosim {

/// The communicator, `grpc, port, "name"`, a socket or files: then the port is named
/// "external<label>". Refuses names that are taken. What the card says goes into `channel`.
std::string read_port_name(Card& card, int label, DeckChannel& channel);
/// `[sleep time, …] [precision, …] [coupling, …] [send after predict, …]`
PortCoupling read_port_timing(Card& card, DeckChannel& channel);
/// `[reference node, …] … [use reference node forces, …]`
void read_port_options(Card& card, StructuralPort& port, DeckChannel& channel);
/// `[echo, "file"]`: only a channel has it.
void read_port_echo(Card& card, DeckChannel& channel);
/// `[accelerations]` of modal forces: no message has them.
void warn_of_modal_accelerations(Card& card);
void register_modal_mapping(Registry& registry);
/// Keeps the channel with the model, unless it is a port of the daemon.
void keep_channel(Card& card, DeckChannel channel);

}  // namespace mbcosim
