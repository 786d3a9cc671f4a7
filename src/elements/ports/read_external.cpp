/// Cards of forces that an external code gives: `force: …, external structural`.
#include "elements/ports/read_external.h"

#include "elements/families.h"
#include "elements/ports/external_structural.h"
#include "elements/ports/port_element.h"
#include "model/card.h"

namespace mbcosim {

namespace {

/// `"in" [, unlink], "out" [, no clobber]`
ChannelAddress read_files(Card& card) {
  ChannelAddress address;
  address.kind = ChannelAddress::Kind::files;
  address.in = card.quoted("file to read");
  address.unlink = card.keyword("unlink");
  address.out = card.quoted("file to write");
  address.no_clobber = card.keyword("no clobber");
  return address;
}

ChannelAddress read_socket(Card& card) {
  const ChannelAddress address = read_channel_address(card, 0);
  if (address.kind == ChannelAddress::Kind::udp)
    card.fail("external forces do not work over UDP", "write `socket type, tcp`");
  card.one_of({"signal", "no signal"});
  return address;
}

/// Name of the port: `grpc, port, "name"`, or "external<label>" for a socket and files.
std::string read_communicator(Card& card, int label, DeckChannel& channel) {
  const SourceSpan where = card.next();
  if (card.peek_word() == "edge")
    card.fail_at(where, "peers that exchange files of EDGE are not supported",
                 "write `socket, ...` or `grpc, port, \"name\"`");
  if (card.at_string()) {
    channel.address = read_files(card);
  } else if (card.required("communicator", {"grpc", "socket"}) == 0) {
    if (!card.keyword("port"))
      card.fail_expected("`port` expected after `grpc`", "write `grpc, port, \"name\"`");
    return card.quoted("name of the port");
  } else {
    channel.address = read_socket(card);
  }
  return "external" + std::to_string(label);
}

void read_coupling(Card& card, DeckChannel& channel) {
  ChannelTiming& timing = channel.timing;
  const SourceSpan where = card.next();
  if (card.keyword("none")) {
    if (channel.address.kind == ChannelAddress::Kind::port)
      card.fail_at(where, "coupling `none` is not supported",
                   "subscribe to the nodes' variables instead; no port is needed to watch");
    timing.listens = timing.send_after_predict = false;
    timing.coupling = PortCoupling::staggered;
    return;
  }
  switch (card.one_of({"staggered", "loose", "tight"})) {
    case 0:
      timing.coupling = PortCoupling::staggered;
      timing.send_after_predict = false;
      return;
    case 1:
      return;
    case 2:
      timing.coupling = PortCoupling::tight;
      return;
    default:
      timing.coupling = PortCoupling::tight;
      timing.every = card.integer("coupling");
      if (timing.every < 1)
        card.fail(
            "coupling must be `staggered`, `loose`, `tight` or a number of "
            "iterations, at least 1");
  }
}

OrientationDescription read_orientation(Card& card) {
  switch (card.required("orientation",
                        {"none", "orientation matrix", "orientation vector", "euler 123"})) {
    case 2:
      return OrientationDescription::vector;
    case 3:
      return OrientationDescription::euler123;
    default:
      return OrientationDescription::matrix;
  }
}

void read_points(Card& card, StructuralPort& port) {
  constexpr int kMost = 1000000;
  const int count = card.integer("number of points");
  if (count < 1 || count > kMost)
    card.fail("the number of points must be from 1 to " + std::to_string(kMost) + ", got " +
              std::to_string(count));
  for (int k = 0; k < count; ++k) {
    const int node = card.structural_node();
    int label = card.model().structural[node].label;
    if (card.keyword("label")) label = card.label("label of the point");
    port.nodes.push_back(node);
    port.point_labels.push_back(label);
    port.offsets.push_back(card.keyword("offset") ? card.relative_position("offset", node)
                                                  : Vec3(Vec3::Zero()));
  }
}

void check_accelerations(Card& card, const StructuralPort& port) {
  if (!port.accelerations) return;
  for (const int node : port.nodes)
    if (!card.model().structural[node].has_momentum())
      card.fail("accelerations need dynamic nodes; " + card.model().node_text(node) + " is none");
}

void read_external_structural(Card& card, ElementInfo& info) {
  StructuralPort port;
  DeckChannel channel;
  port.name = read_port_name(card, info.label, channel);
  port.coupling = read_port_timing(card, channel);
  read_port_options(card, port, channel);
  read_points(card, port);
  check_accelerations(card, port);
  read_port_echo(card, channel);
  const bool kinematics = card.keyword("kinematics");
  port.memory = card.builder().allocate_memory(port.load_size());
  card.model().structural_ports.push_back(port);
  keep_channel(card, std::move(channel));
  add_general_element(card.builder(), info,
                      std::make_unique<ExternalStructural>(std::move(port), kinematics));
}

}  // namespace

std::string read_port_name(Card& card, int label, DeckChannel& channel) {
  const SourceSpan where = card.next();
  channel.port = read_communicator(card, label, channel);
  channel.label = label;
  channel.card = "force " + std::to_string(label);
  if (channel.port.empty()) card.fail_at(where, "the name of the port is empty");
  if (has_port(card.model(), channel.port))
    card.fail_at(where, "there is a port named \"" + channel.port + "\" already");
  return channel.port;
}

PortCoupling read_port_timing(Card& card, DeckChannel& channel) {
  ChannelAddress& address = channel.address;
  if (card.keyword("sleep time")) {
    address.sleep_time = card.real("sleep time");
    if (!(address.sleep_time > 0)) card.fail("the sleep time must be positive");
  }
  if (card.keyword("precision") && !card.keyword("default")) {
    address.precision = card.integer("precision");
    if (address.precision < 1 || address.precision > 17)
      card.fail("the precision must be from 1 to 17 digits");
  }
  ChannelTiming& timing = channel.timing;
  if (card.keyword("coupling")) read_coupling(card, channel);
  if (card.keyword("send after predict")) {
    const bool wanted = card.yes_no("send after predict");
    if (timing.send_after_predict) timing.send_after_predict = wanted;
  }
  if (timing.coupling == PortCoupling::loose && !timing.send_after_predict)
    timing.coupling = PortCoupling::staggered;
  return timing.coupling;
}

void read_port_options(Card& card, StructuralPort& port, DeckChannel& channel) {
  if (card.keyword("reference node")) port.reference = card.structural_node();
  if (card.keyword("labels")) channel.labels = card.yes_no("labels");
  if (card.keyword("sorted")) channel.sorted = card.yes_no("sorted");
  if (!channel.sorted && !channel.labels && channel.address.kind != ChannelAddress::Kind::port)
    card.fail("`sorted, no` needs labels", "write `labels, yes` before it");
  if (card.keyword("orientation")) {
    channel.rotations = card.peek_word() != "none";
    port.orientation = read_orientation(card);
  }
  if (card.keyword("accelerations")) port.accelerations = card.yes_no("accelerations");
  channel.accelerations = port.accelerations;
  port.use_reference_loads = port.reference >= 0;
  if (!card.keyword("use reference node forces")) return;
  if (port.reference < 0) card.fail("`use reference node forces` needs a `reference node`");
  port.use_reference_loads = card.yes_no("use reference node forces");
  if (!port.use_reference_loads || !card.keyword("rotate reference node forces")) return;
  channel.rotate_reference_loads = card.yes_no("rotate reference node forces");
  if (!channel.rotate_reference_loads && channel.address.kind == ChannelAddress::Kind::port)
    card.fail("the loads on the reference node travel in the frame of the others",
              "leave `rotate reference node forces` out");
}

void read_port_echo(Card& card, DeckChannel& channel) {
  if (!card.keyword("echo")) return;
  if (channel.address.kind == ChannelAddress::Kind::port)
    card.fail("`echo` is not supported",
              "leave it out; DescribeSimulation tells the port's layout");
  channel.echo = card.quoted("echo");
}

void keep_channel(Card& card, DeckChannel channel) {
  if (channel.address.kind != ChannelAddress::Kind::port)
    card.builder().on_step(std::make_shared<DeckChannel>(std::move(channel)));
}

void warn_of_modal_accelerations(Card& card) {
  if (card.keyword("accelerations"))
    card.warn("`accelerations` has no effect: they do not travel in modal messages");
}

void register_external_forces(Registry& registry) {
  registry.typed("force", Family::force, {"external structural"}, read_external_structural);
  register_modal_mapping(registry);
}

}  // namespace mbcosim
