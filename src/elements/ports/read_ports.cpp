/// Cards of ports besides `external structural` and `external modal mapping`.
#include <algorithm>
#include <cmath>
#include <limits>

#include "elements/families.h"
#include "elements/ports/external_modal.h"
#include "elements/ports/mapped_structural.h"
#include "elements/ports/mapping_file.h"
#include "elements/ports/read_external.h"
#include "elements/ports/stream_output.h"
#include "model/card.h"

namespace mbcosim {

namespace {

constexpr int kMostPoints = 100000;

// ------------------------------------------------------------------ external structural mapping

/// `points number, P, <node>, offset, [label, l,] f, …, <node>, …`
void read_mapped_points(Card& card, StructuralPort& port) {
  if (!card.keyword("points number")) card.fail_expected("`points number` expected");
  const int count = card.integer("number of points");
  if (count < 1 || count > kMostPoints)
    card.fail("the number of points must be from 1 to " + std::to_string(kMostPoints) + ", got " +
              std::to_string(count));
  while (port.points() < count) {
    const int node = card.structural_node();
    if (!card.keyword("offset")) card.fail_expected("`offset` expected after the node");
    do {
      int label = port.points() + 1;
      if (card.keyword("label")) label = card.label("label of the point");
      port.nodes.push_back(node);
      port.point_labels.push_back(label);
      port.offsets.push_back(card.relative_position("offset", node));
    } while (port.points() < count && card.keyword("offset"));
  }
}

/// `mapped points number, {from file | n}, {full | sparse} mapping file, [threshold, t,] "file" [,
/// labels]`
MappingMatrix read_mapping(Card& card, StructuralPort& port) {
  const int columns = 3 * port.points();
  if (!card.keyword("mapped points number")) {
    MappingMatrix same(columns, columns);
    same.setIdentity();
    return same;
  }
  int rows = -1;
  if (!card.keyword("from file")) {
    const int count = card.integer("number of mapped points");
    if (count < 1 || count > kMostPoints)
      card.fail("the number of mapped points must be from 1 to " + std::to_string(kMostPoints) +
                ", got " + std::to_string(count));
    rows = 3 * count;
  }
  MappingMatrix H = read_mapping_file(card, rows, columns, 3);
  const int mapped = static_cast<int>(H.rows()) / 3;
  port.point_labels.clear();
  if (card.keyword("mapped labels file")) {
    std::string name;
    std::size_t lines = 0;
    for (const double label :
         read_mapping_numbers(card, card.file_contents("labels of mapped points", &name), &lines)) {
      if (!(label >= 0 && label <= std::numeric_limits<int>::max() && label == std::floor(label)))
        card.fail("\"" + name +
                  "\": labels of mapped points are whole numbers, not negative, got " +
                  std::to_string(label));
      port.point_labels.push_back(static_cast<int>(label));
    }
    if (static_cast<int>(port.point_labels.size()) != mapped)
      card.fail("\"" + name + "\" has " + std::to_string(port.point_labels.size()) +
                " labels for " + std::to_string(mapped) + " mapped points");
  } else {
    const bool given = card.more() && card.peek_word() != "echo";
    for (int k = 0; k < mapped; ++k)
      port.point_labels.push_back(given ? card.label("label of a mapped point") : k + 1);
  }
  return H;
}

void read_external_mapping(Card& card, ElementInfo& info) {
  StructuralPort points;
  DeckChannel channel;
  channel.content = DeckChannel::Content::mapped;
  points.name = read_port_name(card, info.label, channel);
  points.coupling = read_port_timing(card, channel);
  read_port_options(card, points, channel);
  if (channel.labels && channel.address.kind != ChannelAddress::Kind::port)
    card.fail("the messages of a mapping have no labels", "write `labels, no`");
  read_mapped_points(card, points);
  if (card.keyword("membrane"))
    card.fail("`membrane` is not supported", "give the matrix in a mapping file");
  MappingMatrix H = read_mapping(card, points);
  if (card.keyword("echo"))
    card.fail("`echo` is not supported",
              "leave it out; DescribeSimulation tells the port's layout");
  keep_channel(card, std::move(channel));
  ElementPort port;
  port.kind = ElementPort::Kind::mapped;
  port.name = points.name;
  port.coupling = points.coupling;
  port.nodes = points.nodes;
  port.input_size = points.load_size();
  port.memory = points.memory = card.builder().allocate_memory(port.input_size);
  add_general_element(
      card.builder(), info,
      std::make_unique<MappedStructural>(std::move(points), std::move(port), std::move(H)));
}

// ------------------------------------------------------------------ external modal

void read_external_modal(Card& card, ElementInfo& info) {
  DeckChannel channel;
  channel.content = DeckChannel::Content::modal;
  const std::string name = read_port_name(card, info.label, channel);
  const PortCoupling coupling = read_port_timing(card, channel);
  const ModalJointSet* joints = nullptr;
  int node = -1, joint = -1;
  if (card.keyword("reference node")) {
    node = card.structural_node();
  } else {
    const ElementRef ref = card.element(Family::joint);
    joints = dynamic_cast<const ModalJointSet*>(ref.set);
    if (!joints)
      card.fail("external modal: joint " + std::to_string(ref.set->info(ref.index).label) +
                " is not a modal joint");
    joint = ref.index;
    node = joints->joint(joint).node;
  }
  warn_of_modal_accelerations(card);
  int type = joints ? (node >= 0 ? 2 : 1) : 0;
  if (card.keyword("type")) {
    type = card.required("type", {"rigid", "modal", "all"});
    if (type != 1 && node < 0)
      card.fail("external modal: this type needs a modal node; the joint is clamped");
    if (type != 0 && !joints) card.fail("external modal: this type needs a modal joint");
  }
  ElementPort port;
  if (joints) {
    channel.modes =
        static_cast<int>(modal_port(card.model(), *joints, joint, false, true).mode_numbers.size());
    port = modal_port(card.model(), *joints, joint, type != 1, type != 0);
  } else {
    port.kind = ElementPort::Kind::modal;
    port.nodes = {node};
    port.input_size = 6;
  }
  keep_channel(card, std::move(channel));
  port.name = name;
  port.coupling = coupling;
  port.memory = card.builder().allocate_memory(port.input_size);
  add_general_element(card.builder(), info,
                      std::make_unique<ExternalModal>(std::move(port), joints, joint));
}

// ------------------------------------------------------------------ stream output

void read_stream_flags(Card& card, DeckChannel& channel) {
  enum { signal, no_signal, blocking, non_blocking, send_first, no_send_first, abort, go_on };
  for (;;) {
    const int flag = card.one_of({"signal", "no signal", "blocking", "non blocking", "send first",
                                  "no send first", "abort if broken", "do not abort if broken"});
    if (flag < 0) return;
    if (flag == signal || flag == no_signal) channel.signal = flag == signal;
    if (flag == blocking || flag == non_blocking) channel.blocking = flag == blocking;
    if (flag == send_first || flag == no_send_first) channel.at_start = flag == send_first;
    if (flag == abort || flag == go_on) channel.abort_if_broken = flag == abort;
  }
}

/// What stands before the content: name, address and flags.
/// The name may have followed the label, as it may for every element.
ElementPort read_stream_head(Card& card, const ElementInfo& info, DeckChannel& channel) {
  const std::string& named = info.name;
  constexpr int kDefaultPort = 9011;
  ElementPort port;
  const bool has_name = card.one_of({"stream name", "name"}) >= 0;
  if (!has_name && named.empty()) card.fail_expected("stream output: `stream name` expected");
  const SourceSpan where = has_name ? card.next() : card.last();
  port.name = has_name ? card.quoted("stream name") : named;
  if (port.name.empty()) card.fail_at(where, "the name of the stream is empty");
  if (has_port(card.model(), port.name))
    card.fail_at(where, "there is a port named \"" + port.name + "\" already");
  channel.content = DeckChannel::Content::output;
  channel.label = info.label;
  channel.port = port.name;
  channel.card = "stream output \"" + port.name + "\"";
  channel.address = read_channel_address(card, kDefaultPort);
  read_stream_flags(card, channel);
  if (card.keyword("output every")) {
    port.every = channel.every = card.integer("steps between two outputs");
    if (port.every < 1)
      card.fail("stream output: the steps between two outputs must be at least 1");
  }
  if (channel.address.kind == ChannelAddress::Kind::port && card.peek_word() == "echo")
    card.fail_at(card.next(), "stream output: `echo` is not supported",
                 "leave it out; the service's telemetry and records tell what is sent");
  read_channel_echo(card, channel);
  return port;
}

std::vector<StreamOutput::Value> read_stream_values(Card& card, ElementPort& port) {
  constexpr int kMost = 65536;
  const int count = card.integer("number of channels");
  if (count < 1 || count > kMost)
    card.fail("stream output: the number of channels must be from 1 to " + std::to_string(kMost) +
              ", got " + std::to_string(count));
  std::vector<StreamOutput::Value> values(count);
  for (int k = 0; k < count; ++k) {
    if (card.keyword("drive"))
      values[k].drive = card.drive("stream output");
    else {
      card.keyword("nodedof");
      values[k].dof = card.node_dof(true);
    }
    port.output_names.push_back("channel." + std::to_string(k + 1));
  }
  return values;
}

std::vector<StreamOutput::Motion> read_motion_flags(Card& card) {
  using Motion = StreamOutput::Motion;
  constexpr Motion kKinds[] = {Motion::position, Motion::orientation,
                               Motion::transposed_orientation, Motion::velocity,
                               Motion::angular_velocity};
  const auto next = [&] {
    return card.one_of({"position", "orientation matrix", "orientation matrix transpose",
                        "velocity", "angular velocity"});
  };
  if (!card.keyword("output flags")) return {Motion::position};
  std::vector<Motion> motion;
  for (int kind = next(); kind >= 0; kind = next()) {
    if (std::find(motion.begin(), motion.end(), kKinds[kind]) != motion.end())
      card.fail("stream output: `output flags` has the same twice");
    motion.push_back(kKinds[kind]);
  }
  if (motion.empty())
    card.fail_at(card.next(), "stream output: `output flags` must be followed by what is sent");
  return motion;
}

std::vector<int> read_motion_nodes(Card& card) {
  std::vector<int> nodes;
  if (card.keyword("all")) {
    for (std::size_t k = 0; k < card.model().structural.size(); ++k)
      if (!card.model().structural[k].is_dummy()) nodes.push_back(static_cast<int>(k));
    return nodes;
  }
  do nodes.push_back(card.structural_node(Card::NodeNeed::any));
  while (card.more() && card.peek_word() != "modifier");
  return nodes;
}

void name_motion(const Model& model, const std::vector<StreamOutput::Motion>& motion,
                 const std::vector<int>& nodes, ElementPort& port) {
  constexpr const char* kNames[] = {"X", "R", "Rt", "XP", "Omega"};
  for (const int node : nodes)
    for (const StreamOutput::Motion kind : motion) {
      const bool matrix = kind == StreamOutput::Motion::orientation ||
                          kind == StreamOutput::Motion::transposed_orientation;
      for (int i = 0; i < (matrix ? 9 : 3); ++i)
        port.output_names.push_back("node." + std::to_string(model.structural[node].label) + "." +
                                    kNames[static_cast<int>(kind)] + "." + std::to_string(i + 1));
    }
}

/// `values n`, or a 0 or 1 for each kind of motion and the labels of the nodes.
std::string content_text(const Model& model, int values,
                         const std::vector<StreamOutput::Motion>& motion,
                         const std::vector<int>& nodes) {
  using Motion = StreamOutput::Motion;
  if (motion.empty()) return "values " + std::to_string(values);
  std::string s = "motion";
  for (const Motion kind : {Motion::position, Motion::orientation, Motion::transposed_orientation,
                            Motion::velocity, Motion::angular_velocity})
    s += std::count(motion.begin(), motion.end(), kind) > 0 ? " 1" : " 0";
  for (const int node : nodes) s += ' ' + std::to_string(model.structural[node].label);
  return s;
}

/// All its words mean the same; old decks leave `values` or `motion` out, which the head then says.
void read_stream_output(Card& card, ElementInfo& info, bool motion_by_default) {
  DeckChannel channel;
  ElementPort port = read_stream_head(card, info, channel);
  std::vector<StreamOutput::Value> values;
  std::vector<StreamOutput::Motion> motion;
  std::vector<int> nodes;
  const int content = card.one_of({"values", "motion"});
  if (content == 1 || (content < 0 && motion_by_default)) {
    motion = read_motion_flags(card);
    nodes = read_motion_nodes(card);
    name_motion(card.model(), motion, nodes, port);
  } else {
    values = read_stream_values(card, port);
  }
  read_channel_modifier(card, static_cast<int>(port.output_names.size()), channel);
  channel.log_end = content_text(card.model(), static_cast<int>(values.size()), motion, nodes);
  std::string log = channel.address.kind == ChannelAddress::Kind::port ? "" : log_line(channel);
  keep_channel(card, std::move(channel));
  port.output_size = static_cast<int>(port.output_names.size());
  add_general_element(
      card.builder(), info,
      std::make_unique<StreamOutput>(std::move(port), std::move(values), std::move(motion),
                                     std::move(nodes), std::move(log)));
}

}  // namespace

void register_ports(Registry& registry) {
  registry.typed("force", Family::force, {"external structural mapping"}, read_external_mapping);
  registry.typed("force", Family::force, {"external modal"}, read_external_modal);
  const auto stream = [](Card& card, ElementInfo& info) { read_stream_output(card, info, false); };
  const auto stream_motion = [](Card& card, ElementInfo& info) {
    read_stream_output(card, info, true);
  };
  registry.typed("output element", Family::output_element, {"stream", "socket stream"}, stream);
  registry.element("stream output", Family::output_element, stream);
  registry.element("RTAI output", Family::output_element, stream);
  registry.element("stream motion output", Family::output_element, stream_motion);
}

}  // namespace mbcosim
