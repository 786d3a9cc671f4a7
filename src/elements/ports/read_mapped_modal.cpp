/// The card `force: …, external modal mapping`.
#include <algorithm>

#include "elements/families.h"
#include "elements/ports/mapped_modal.h"
#include "elements/ports/mapping_file.h"
#include "elements/ports/read_external.h"
#include "model/card.h"

namespace mbcosim {

namespace {

constexpr int kMostNodes = 100000;

/// `[reference node, <node>, [use rigid body forces, b [, rotate rigid body forces, b]]]
/// [accelerations] [type, …]`; are rigid motion and loads to travel, are modes?
std::pair<bool, bool> read_mapped_modal_options(Card& card, MappedModal::Settings& s) {
  if (card.keyword("reference node")) {
    s.reference = card.structural_node();
    if (card.keyword("use rigid body forces"))
      s.use_rigid_loads = card.yes_no("use rigid body forces");
    if (s.use_rigid_loads && card.keyword("rotate rigid body forces"))
      s.rotate_rigid_loads = card.yes_no("rotate rigid body forces");
  }
  warn_of_modal_accelerations(card);
  const bool has_type = card.keyword("type");
  const int type = has_type ? card.required("type", {"rigid", "modal", "all"}) : 2;
  if (has_type && type != 1 && s.reference < 0)
    card.fail(
        "external modal mapping: rigid motion is that of a `reference node`, which is missing",
        "write `type, modal`");
  return {s.reference >= 0 && type != 1, type != 0};
}

void read_mapped_nodes(Card& card, MappedModal::Settings& s) {
  if (!card.keyword("nodes number")) card.fail_expected("`nodes number` expected");
  const int count = card.integer("number of nodes");
  if (count < 1 || count > kMostNodes)
    card.fail("the number of nodes must be from 1 to " + std::to_string(kMostNodes) + ", got " +
              std::to_string(count));
  for (int k = 0; k < count; ++k) {
    const int node = card.structural_node();
    if (std::find(s.nodes.begin(), s.nodes.end(), node) != s.nodes.end())
      card.fail(card.model().node_text(node) + " is listed twice");
    s.nodes.push_back(node);
  }
}

void read_external_modal_mapping(Card& card, ElementInfo& info) {
  constexpr int kMostModes = 10000;
  DeckChannel channel;
  channel.content = DeckChannel::Content::modal;
  ElementPort port;
  port.kind = ElementPort::Kind::modal;
  port.name = read_port_name(card, info.label, channel);
  if (channel.address.kind == ChannelAddress::Kind::files)
    card.fail("external modal mapping: files are no communicator of this force",
              "write `socket, …` or `grpc, port, \"name\"`");
  port.coupling = read_port_timing(card, channel);
  MappedModal::Settings s;
  const auto [rigid, modal] = read_mapped_modal_options(card, s);
  read_mapped_nodes(card, s);
  if (!card.keyword("modes number")) card.fail_expected("`modes number` expected");
  int modes = -1;
  if (!card.keyword("from file")) {
    modes = card.integer("number of modes");
    if (modes < 1 || modes > kMostModes)
      card.fail("the number of modes must be from 1 to " + std::to_string(kMostModes) + ", got " +
                std::to_string(modes));
  }
  s.H = read_mapping_file(card, modes, static_cast<int>(6 * s.nodes.size()), 1);
  channel.modes = modes = static_cast<int>(s.H.rows());
  if (rigid) port.nodes = {s.reference};
  for (int k = 1; modal && k <= modes; ++k) port.mode_numbers.push_back(k);
  const int travelling = static_cast<int>(port.mode_numbers.size());
  port.input_size = (rigid ? 6 : 0) + travelling;
  port.output_size = 2 * travelling;
  port.memory = card.builder().allocate_memory(port.input_size);
  keep_channel(card, std::move(channel));
  add_general_element(card.builder(), info,
                      std::make_unique<MappedModal>(std::move(port), std::move(s), card.model(),
                                                    card.builder().input_context()));
}

}  // namespace

void register_modal_mapping(Registry& registry) {
  registry.typed("force", Family::force, {"external modal mapping"}, read_external_modal_mapping);
}

}  // namespace mbcosim
