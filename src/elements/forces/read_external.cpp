/// Cards of forces that an external code gives: `force: …, external structural`.
#include "elements/forces/read_external.h"

#include "elements/families.h"
#include "elements/forces/external_structural.h"
#include "elements/ports/port_element.h"
#include "model/card.h"

namespace mbcosim {

namespace {

/// A socket of the reference solver: the words are read, the peer attaches to a port instead.
void skip_socket(Card& card) {
  if (card.keyword("create")) card.yes_no("create");
  if (card.one_of({"path", "local"}) >= 0) {
    card.quoted("path");
  } else {
    if (card.keyword("port")) card.integer("port");
    if (card.keyword("host")) card.quoted("host");
  }
  if (card.keyword("socket type")) card.required("socket type", {"tcp", "udp"});
  card.one_of({"signal", "no signal"});
}

/// Name of the port: `grpc, port, "name"`, or "external<label>" for a socket.
std::string read_communicator(Card& card, int label) {
  const SourceSpan where = card.next();
  if (card.at_string() || card.peek_word() == "edge")
    card.fail_at(
        where, "peers that exchange files are not supported",
        "write `grpc, port, \"name\"`; the peer attaches to the daemon's port of that name");
  if (card.required("communicator", {"grpc", "socket"}) == 0) {
    if (!card.keyword("port"))
      card.fail_expected("`port` expected after `grpc`", "write `grpc, port, \"name\"`");
    return card.quoted("name of the port");
  }
  skip_socket(card);
  const std::string name = "external" + std::to_string(label);
  card.warn_at(where,
               "the socket is not opened; peers attach to the daemon's port \"" + name + "\"",
               "write `grpc, port, \"name\"`");
  return name;
}

PortCoupling read_coupling(Card& card) {
  if (!card.keyword("coupling")) return PortCoupling::loose;
  const SourceSpan where = card.next();
  if (card.keyword("none"))
    card.fail_at(where, "coupling `none` is not supported",
                 "subscribe to the nodes' variables instead; no port is needed to watch");
  switch (card.one_of({"staggered", "loose", "tight"})) {
    case 0:
      return PortCoupling::staggered;
    case 1:
      return PortCoupling::loose;
    case 2:
      return PortCoupling::tight;
    default:
      if (card.integer("coupling") < 1)
        card.fail(
            "coupling must be `staggered`, `loose`, `tight` or a number of "
            "iterations, at least 1");
      return PortCoupling::tight;
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
  port.name = read_port_name(card, info.label);
  port.coupling = read_port_timing(card);
  read_port_options(card, port);
  read_points(card, port);
  check_accelerations(card, port);
  if (card.keyword("echo"))
    card.fail("`echo` is not supported",
              "leave it out; DescribeSimulation tells the port's layout");
  const bool kinematics = card.keyword("kinematics");
  port.memory = card.builder().allocate_memory(port.load_size());
  card.model().structural_ports.push_back(port);
  add_general_element(card.builder(), info,
                      std::make_unique<ExternalStructural>(std::move(port), kinematics));
}

}  // namespace

std::string read_port_name(Card& card, int label) {
  const SourceSpan where = card.next();
  std::string name = read_communicator(card, label);
  if (name.empty()) card.fail_at(where, "the name of the port is empty");
  if (has_port(card.model(), name))
    card.fail_at(where, "there is a port named \"" + name + "\" already");
  return name;
}

PortCoupling read_port_timing(Card& card) {
  if (card.keyword("sleep time")) card.real("sleep time");
  if (card.keyword("precision") && !card.keyword("default")) card.integer("precision");
  const PortCoupling coupling = read_coupling(card);
  if (card.keyword("send after predict")) card.yes_no("send after predict");
  return coupling;
}

void read_port_options(Card& card, StructuralPort& port) {
  if (card.keyword("reference node")) port.reference = card.structural_node();
  if (card.keyword("labels")) card.yes_no("labels");  // the layout of the port always has them
  if (card.keyword("sorted")) card.yes_no("sorted");
  if (card.keyword("orientation")) port.orientation = read_orientation(card);
  if (card.keyword("accelerations")) port.accelerations = card.yes_no("accelerations");
  port.use_reference_loads = port.reference >= 0;
  if (!card.keyword("use reference node forces")) return;
  if (port.reference < 0) card.fail("`use reference node forces` needs a `reference node`");
  port.use_reference_loads = card.yes_no("use reference node forces");
  if (port.use_reference_loads && card.keyword("rotate reference node forces") &&
      !card.yes_no("rotate reference node forces"))
    card.fail("the loads on the reference node travel in the frame of the others",
              "leave `rotate reference node forces` out");
}

void register_external_forces(Registry& registry) {
  registry.typed("force", Family::force, {"external structural"}, read_external_structural);
}

}  // namespace mbcosim
