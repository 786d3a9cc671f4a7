#include <algorithm>
#include <cmath>
#include <cstdio>
#include <sstream>
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

/// Point k of a client::Motion, or its reference node. Mapped points have positions and their rates
/// alone.
template <class Source>
PointState point_of(const Source& motion, std::size_t k) {
  const auto put = [k](const std::vector<double>& numbers, Vec3& v) {
    if (!numbers.empty()) v = triple(numbers, k);
  };
  PointState p;
  put(motion.x, p.x);
  if (!motion.R.empty())
    p.R = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(&motion.R[9 * k]);
  put(motion.v, p.v);
  put(motion.w, p.w);
  put(motion.a, p.a);
  put(motion.wp, p.wp);
  return p;
}

using Form = mbdyn::ForceForm;

void make_points(const client::PortLayout& layout, const SocketCall& call, Form& form) {
  form.reference = layout.reference_node.has_value();
  form.reference_label = static_cast<std::uint32_t>(layout.reference_node.value_or(0));
  form.labels = call.labels;
  if (!layout.mapped_points) {
    form.count = static_cast<std::uint32_t>(layout.node_labels.size());
    form.node_labels.assign(layout.node_labels.begin(), layout.node_labels.end());
    form.point_labels.assign(layout.point_labels.begin(), layout.point_labels.end());
    return;
  }
  if (call.labels)
    throw std::runtime_error("port \"" + layout.name + "\": mapped points have no labels");
  if (form.reference && form.rotation == Form::Rotation::none)
    throw std::runtime_error("port \"" + layout.name +
                             "\": the reference node of mapped points has an orientation");
  form.kind = Form::Kind::mapped;
  form.count = static_cast<std::uint32_t>(*layout.mapped_points);
}

Form form_of(const client::PortLayout& layout, const SocketCall& call) {
  using Rotation = Form::Rotation;
  static const std::map<std::string, Rotation> kRotations = {{"none", Rotation::none},
                                                             {"vector", Rotation::vector},
                                                             {"matrix", Rotation::matrix},
                                                             {"euler123", Rotation::euler123}};
  if (layout.motion)
    throw std::runtime_error("port \"" + layout.name +
                             "\" takes imposed motion, which no code of MBDyn's protocols sends");
  Form form;
  form.rotation = kRotations.at(call.rotation);
  form.sorted = !call.unsorted;
  form.pads_labels = call.pads_labels;
  form.accelerations = call.accelerations;
  form.modes = static_cast<int>(layout.mode_numbers.size());
  if (!layout.modal) {
    make_points(layout, call, form);
    return form;
  }
  form.kind = Form::Kind::modal;
  form.reference = !layout.node_labels.empty();
  form.count = static_cast<std::uint32_t>(form.modes);
  return form;
}

/// Daemons of earlier versions tell neither reference nodes nor mapped points.
void check_motion(const Form& form, const client::Motion& motion) {
  const bool modal = form.kind == Form::Kind::modal;
  const std::size_t points = modal ? (form.reference ? 1 : 0) : form.count;
  const std::size_t orientations = form.kind == Form::Kind::mapped ? 0 : points;
  const bool told = modal || !form.reference || !motion.reference.x.empty();
  if (!told || motion.x.size() != 3 * points || motion.R.size() != 9 * orientations)
    throw mbdyn::ChannelLost("the daemon does not tell the motion that this port's code needs");
}

mbdyn::ForceState state_of(const Form& form, const client::Motion& motion) {
  check_motion(form, motion);
  mbdyn::ForceState state;
  if (form.kind == Form::Kind::modal) {
    if (form.reference) state.reference = point_of(motion, 0);
    state.q.assign(motion.signals.begin(), motion.signals.begin() + form.modes);
    state.qp.assign(motion.signals.begin() + form.modes, motion.signals.end());
    return state;
  }
  if (form.reference) state.reference = point_of(motion.reference, 0);
  for (std::size_t k = 0; k < form.count; ++k) state.points.push_back(point_of(motion, k));
  return state;
}

/// What a port takes of a code's loads.
struct LoadsForm {
  Form form;
  bool reference_loads = false;  ///< the port takes the total load on the reference node
};

client::Loads loads_of(const LoadsForm& as, const mbdyn::ForceLoads& from) {
  client::Loads loads;
  const auto put = [](const Vec3& v, std::vector<double>& out) {
    out.insert(out.end(), v.data(), v.data() + 3);
  };
  if (as.form.kind == Form::Kind::modal) {
    if (as.form.reference) {
      put(from.f0, loads.forces);
      put(from.m0, loads.moments);
    }
    loads.signals = from.p;
    return loads;
  }
  for (const Vec3& f : from.f) put(f, loads.forces);
  if (as.form.kind == Form::Kind::nodal)
    for (const Vec3& m : from.m) put(m, loads.moments);
  if (!as.reference_loads) return loads;
  put(from.f0, loads.reference_force);
  put(from.m0, loads.reference_moment);
  return loads;
}

/// Looks whether the simulation goes back across steps, which no code of these protocols can be
/// told. A step that is repeated, and one that is iterated, is none of that.
class Progress {
 public:
  /// Throws ChannelLost.
  void check(const client::Motion& motion) {
    const bool before = motion.step < step_;
    const bool again = ended_ && motion.iteration > 0 && motion.step == step_ &&
                       motion.time <= time_ + tolerance_at(time_);
    if (before || again) {
      std::ostringstream text;
      text << "the simulation went back to t = " << motion.time
           << ", which the code cannot be told; attach it anew";
      throw mbdyn::ChannelLost(text.str());
    }
    step_ = motion.step;
    time_ = motion.time;
    ended_ = false;
  }
  /// An implicit step has ended: accepted, or to be redone from the end of step `step`.
  void step_ended(bool accepted, std::int64_t step) {
    ended_ = accepted;
    if (!accepted) step_ = std::min(step_, step);
  }

 private:
  std::int64_t step_ = -1;
  double time_ = 0;     ///< [s]
  bool ended_ = false;  ///< the last exchange was that of an implicit step that was accepted
};

/// Answers of a code to the exchanges of a port. In an implicit step the code is asked until it is
/// done; its last loads then serve the rest of the step.
class SocketAnswers {
 public:
  SocketAnswers(mbdyn::SocketWire& wire, LoadsForm as) : wire_(wire), as_(std::move(as)) {}

  client::Loads answer(const client::Motion& motion) {
    const bool implicit = motion.iteration > 0;
    if (motion.iteration <= 1) done_ = false;
    const mbdyn::ForceState state = state_of(as_.form, motion);
    if (!done_) ask(implicit ? mbdyn::kData : mbdyn::kLastData, state);
    if (!last_) throw mbdyn::ChannelLost("the code keeps loads that it never gave");
    client::Loads loads = loads_of(as_, *last_);
    loads.unfinished = implicit && !done_;
    return loads;
  }
  bool ended() const { return ended_; }

 private:
  void ask(mbdyn::Command how, const mbdyn::ForceState& state) {
    wire_.send(how, state);
    mbdyn::ForceLoads loads;
    const mbdyn::Command command = wire_.receive(loads);
    if (command == mbdyn::kData || command == mbdyn::kLastData) last_ = std::move(loads);
    ended_ = command == mbdyn::kEnd;
    done_ = command != mbdyn::kData;
  }

  mbdyn::SocketWire& wire_;
  const LoadsForm as_;
  std::optional<mbdyn::ForceLoads> last_;
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
bool answer_next(const PeerCall& call, client::Peer& peer, Progress& progress, Answer&& answer) {
  client::Motion motion;
  if (!next_exchange(call, peer, motion)) return false;
  try {
    progress.check(motion);
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
void serve_streams(const PeerCall& call, client::Peer& peer, std::size_t inputs, Progress& progress,
                   const std::vector<std::unique_ptr<mbdyn::Link>>& links) {
  while (answer_next(call, peer, progress, [&](const client::Motion& motion) {
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

/// At the end, good or bad, the code gets 5. False: it was the code's.
bool serve_forces(const PeerCall& call, client::Peer& peer, Progress& progress,
                  mbdyn::SocketWire& wire, SocketAnswers& answers,
                  std::chrono::milliseconds farewell) {
  try {
    while (!answers.ended() && answer_next(call, peer, progress, [&](const client::Motion& motion) {
      return answers.answer(motion);
    })) {
    }
  } catch (...) {
    wire.end(mbdyn::Clock::now() + farewell);
    throw;
  }
  wire.end(mbdyn::Clock::now() + farewell);
  return !answers.ended();
}

bool has_reference(const client::Simulation& simulation, const std::string& port) {
  const auto ports = simulation.ports();
  return std::any_of(ports.begin(), ports.end(), [&](const client::PortLayout& layout) {
    return layout.name == port && layout.reference_node;
  });
}

}  // namespace

void serve_socket(const PeerCall& call, const SocketCall& socket) {
  const mbdyn::Patience patience{
      .time = std::chrono::milliseconds(static_cast<long long>(1000 * call.timeout)),
      .cancelled = [&call] { return call.interrupted(); }};
  client::Server server = server::reach(call.daemon);
  client::Simulation simulation = server.find(call.simulation);
  client::PeerOptions options = options_of(call);
  options.accelerations = socket.accelerations;
  options.following_loads = has_reference(simulation, call.port);
  if (options.following_loads) options.frame = client::Frame::reference;
  options.global_reference_loads = socket.global_reference_loads;
  Progress progress;
  options.step_ended = [&](bool accepted, std::int64_t step, double) {
    progress.step_ended(accepted, step);
  };
  std::vector<std::unique_ptr<mbdyn::Link>> links = open_links(socket, patience);
  client::Peer peer = simulation.attach(call.port, options);
  const SimulationWatch watch(call, server, peer);
  if (is_signal_port(peer.layout())) {
    if (options.mode == client::Mode::tight || options.mode == client::Mode::window)
      throw std::runtime_error("streams know no iterations: give --mode loose or staggered");
    serve_streams(call, peer, expanded(simulation, peer.layout().inputs).size(), progress, links);
    return require_good_end(server, call, peer);
  }
  if (links.size() > 1)
    throw std::runtime_error("inputs of their own link are those of a signal port; \"" + call.port +
                             "\" is none");
  const Form form = form_of(peer.layout(), socket);
  mbdyn::SocketWire wire(std::move(links[0]), form, socket.address.create);
  SocketAnswers answers(wire, {form, peer.layout().reference_loads});
  if (serve_forces(call, peer, progress, wire, answers, patience.farewell))
    require_good_end(server, call, peer);
}

}  // namespace mbcosim::peer
