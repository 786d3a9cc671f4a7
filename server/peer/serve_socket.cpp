#include <cstdio>
#include <stdexcept>

#include "mbdyn/link.h"
#include "mbdyn/socket_wire.h"
#include "mbdyn/stream_message.h"
#include "peer/options.h"
#include "peer/simulation_watch.h"

namespace mbcosim::peer {
namespace {

Vec3 triple(const std::vector<double>& numbers, std::size_t k) {
  return Vec3(numbers[3 * k], numbers[3 * k + 1], numbers[3 * k + 2]);
}

PointState point_of(const client::Motion& motion, std::size_t k) {
  PointState p;
  p.x = triple(motion.x, k);
  p.R = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(&motion.R[9 * k]);
  p.v = triple(motion.v, k);
  p.w = triple(motion.w, k);
  if (motion.a.empty()) return p;
  p.a = triple(motion.a, k);
  p.wp = triple(motion.wp, k);
  return p;
}

mbdyn::ForceForm form_of(const client::PortLayout& layout, const SocketCall& call) {
  using Rotation = mbdyn::ForceForm::Rotation;
  static const std::map<std::string, Rotation> kRotations = {{"none", Rotation::none},
                                                             {"vector", Rotation::vector},
                                                             {"matrix", Rotation::matrix},
                                                             {"euler123", Rotation::euler123}};
  mbdyn::ForceForm form;
  if (layout.reference_node != 0)
    throw std::runtime_error("a port with a reference node is served by `mbcosim run` only");
  form.rotation = kRotations.at(call.rotation);
  form.labels = call.labels;
  form.sorted = !call.unsorted;
  form.pads_labels = call.pads_labels;
  form.accelerations = call.accelerations;
  form.modes = static_cast<int>(layout.mode_numbers.size());
  if (layout.modal) {
    form.kind = mbdyn::ForceForm::Kind::modal;
    form.reference = !layout.node_labels.empty();
    form.count = static_cast<std::uint32_t>(form.modes);
    return form;
  }
  form.count = static_cast<std::uint32_t>(layout.node_labels.size());
  form.node_labels.assign(layout.node_labels.begin(), layout.node_labels.end());
  form.point_labels.assign(layout.point_labels.begin(), layout.point_labels.end());
  return form;
}

/// A mapped port has no orientations, and points that its layout does not tell.
void check_points(const mbdyn::ForceForm& form, const client::Motion& motion) {
  const std::size_t points =
      form.kind == mbdyn::ForceForm::Kind::modal ? (form.reference ? 1 : 0) : form.count;
  if (motion.x.size() != 3 * points || motion.R.size() != 9 * points)
    throw mbdyn::ChannelLost("a mapped port is served by `mbcosim run` only");
}

mbdyn::ForceState state_of(const mbdyn::ForceForm& form, const client::Motion& motion) {
  check_points(form, motion);
  mbdyn::ForceState state;
  for (std::size_t k = 0; 3 * k < motion.x.size(); ++k) state.points.push_back(point_of(motion, k));
  if (form.kind != mbdyn::ForceForm::Kind::modal) return state;
  if (form.reference) state.reference = state.points.at(0);
  state.points.clear();
  state.q.assign(motion.signals.begin(), motion.signals.begin() + form.modes);
  state.qp.assign(motion.signals.begin() + form.modes, motion.signals.end());
  return state;
}

client::Loads loads_of(const mbdyn::ForceForm& form, const mbdyn::ForceLoads& from) {
  client::Loads loads;
  const auto put = [](const Vec3& v, std::vector<double>& out) {
    out.insert(out.end(), v.data(), v.data() + 3);
  };
  if (form.kind == mbdyn::ForceForm::Kind::modal) {
    if (form.reference) {
      put(from.f0, loads.forces);
      put(from.m0, loads.moments);
    }
    loads.signals = from.p;
    return loads;
  }
  for (const Vec3& f : from.f) put(f, loads.forces);
  for (const Vec3& m : from.m) put(m, loads.moments);
  return loads;
}

/// Answers of a code to the exchanges of a port. In an implicit step the code is asked until it is
/// done; its last loads then serve the rest of the step.
class SocketAnswers {
 public:
  SocketAnswers(mbdyn::SocketWire& wire, mbdyn::ForceForm form)
      : wire_(wire), form_(std::move(form)) {}

  client::Loads answer(const client::Motion& motion) {
    const bool implicit = motion.iteration > 0;
    if (motion.iteration <= 1) done_ = false;
    if (!done_) {
      wire_.send(implicit ? mbdyn::kData : mbdyn::kLastData, state_of(form_, motion));
      mbdyn::ForceLoads loads;
      const mbdyn::Command command = wire_.receive(loads);
      if (command == mbdyn::kData || command == mbdyn::kLastData) last_ = loads_of(form_, loads);
      ended_ = command == mbdyn::kEnd;
      done_ = command != mbdyn::kData;
    }
    if (last_.forces.empty() && last_.signals.empty())
      throw mbdyn::ChannelLost("the code keeps loads that it never gave");
    last_.unfinished = implicit && !done_;
    return last_;
  }
  bool ended() const { return ended_; }

 private:
  mbdyn::SocketWire& wire_;
  const mbdyn::ForceForm form_;
  client::Loads last_;
  bool done_ = false, ended_ = false;
};

// ------------------------------------------------------------------ sockets

/// Listens first, so that the codes may come in any order.
std::vector<std::unique_ptr<mbdyn::Link>> open_links(const SocketCall& call,
                                                     const mbdyn::Patience& patience) {
  std::vector<ChannelAddress> addresses{call.address};
  if (call.inputs) addresses.push_back(*call.inputs);
  const auto end = mbdyn::Clock::now() + patience.time;
  const auto name = [](const ChannelAddress& a) { return "the code at " + mbdyn::text_of(a); };
  std::vector<std::unique_ptr<mbdyn::Listener>> listeners(addresses.size());
  for (std::size_t k = 0; k < addresses.size(); ++k) {
    if (!addresses[k].create) continue;
    listeners[k] = std::make_unique<mbdyn::Listener>(addresses[k], name(addresses[k]));
    std::printf("waiting for a code on %s\n", mbdyn::text_of(addresses[k]).c_str());
  }
  std::fflush(stdout);
  std::vector<std::unique_ptr<mbdyn::Link>> links;
  for (std::size_t k = 0; k < addresses.size(); ++k)
    links.push_back(listeners[k]
                        ? listeners[k]->accept(end, patience)
                        : mbdyn::connect_to(addresses[k], name(addresses[k]), end, patience));
  return links;
}

/// Waits for an exchange and answers it; false: there are no more. A lost code fails the step.
template <class Answer>
bool answer_next(client::Peer& peer, Answer&& answer) {
  client::Motion motion;
  if (!peer.next(motion)) return false;
  try {
    peer.answer(answer(motion));
  } catch (const mbdyn::ChannelLost& lost) {
    peer.fail(lost.what());
    throw;
  }
  return true;
}

// ------------------------------------------------------------------ MBDyn's streams

bool is_signal_port(const client::PortLayout& layout) {
  return !layout.modal && layout.node_labels.empty();
}

std::vector<double> receive_inputs(mbdyn::Link& link, std::size_t count) {
  static const DeckChannel kDoubles;  // no `copy cast`
  const int n = static_cast<int>(count);
  try {
    return mbdyn::decode_stream(kDoubles, n, link.receive(mbdyn::stream_size(kDoubles, n)));
  } catch (const mbdyn::ChannelLost& lost) {
    const std::string what = lost.what();
    throw mbdyn::ChannelLost(what.rfind(link.name(), 0) == 0 ? what : link.name() + ": " + what);
  }
}

/// At each exchange the outputs are sent, if there are any, then the inputs are read, if there are
/// any: over one link, or over two.
void serve_streams(const PeerCall& call, client::Peer& peer, std::size_t inputs,
                   const std::vector<std::unique_ptr<mbdyn::Link>>& links) {
  while (answer_next(peer, [&](const client::Motion& motion) {
    if (motion.iteration > 0)
      throw mbdyn::ChannelLost("streams know no iterations: port \"" + call.port +
                               "\" needs --mode loose or staggered");
    if (!motion.signals.empty())
      links.front()->send(mbdyn::encode_stream(DeckChannel(), motion.signals));
    client::Loads loads;
    if (inputs > 0) loads.signals = receive_inputs(*links.back(), inputs);
    return loads;
  })) {
  }
}

}  // namespace

void serve_socket(const PeerCall& call, const SocketCall& socket) {
  const mbdyn::Patience patience{
      .time = std::chrono::milliseconds(static_cast<long long>(1000 * call.timeout))};
  client::Server server = connect(call);
  client::Simulation simulation = server.find(call.simulation);
  client::PeerOptions options = options_of(call);
  options.accelerations = socket.accelerations;
  std::vector<std::unique_ptr<mbdyn::Link>> links = open_links(socket, patience);
  client::Peer peer = simulation.attach(call.port, options);
  const SimulationWatch watch(server, call.simulation, peer);
  if (is_signal_port(peer.layout())) {
    if (options.mode == client::Mode::tight || options.mode == client::Mode::window)
      throw std::runtime_error("streams know no iterations: give --mode loose or staggered");
    return serve_streams(call, peer, expanded(simulation, peer.layout().inputs).size(), links);
  }
  if (links.size() > 1)
    throw std::runtime_error("inputs of their own link are those of a signal port; \"" + call.port +
                             "\" is none");
  const mbdyn::ForceForm form = form_of(peer.layout(), socket);
  mbdyn::SocketWire wire(std::move(links[0]), form, socket.address.create);
  SocketAnswers answers(wire, form);
  while (!answers.ended() &&
         answer_next(peer, [&](const client::Motion& motion) { return answers.answer(motion); })) {
  }
  wire.end(mbdyn::Clock::now() + patience.farewell);
}

}  // namespace mbcosim::peer
