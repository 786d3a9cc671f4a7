#include <cstdio>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <thread>

#include "mbdyn/link.h"
#include "mbdyn/socket_wire.h"
#include "peer/fmu_peer.h"
#include "peer/options.h"
#include "threads/mutex.h"

namespace mbcosim::peer {
namespace {

using client::Mode;

std::string text_of_file(const std::string& path) {
  if (path.empty()) return "";
  std::ifstream in(path);
  if (!in) throw std::runtime_error("cannot read \"" + path + "\"");
  std::string text(std::istreambuf_iterator<char>(in), {});
  while (!text.empty() && text.back() == '\n') text.pop_back();
  return text;
}

Mode mode_of(const std::string& name) {
  if (name == "loose") return Mode::loose;
  if (name == "staggered") return Mode::staggered;
  if (name == "tight") return Mode::tight;
  if (name == "window") return Mode::window;
  return Mode::port_default;
}

/// A name for each number of a variable.
std::vector<std::string> expanded(const client::Simulation& simulation,
                                  const std::vector<std::string>& variables) {
  std::vector<std::string> names;
  for (const std::string& variable : variables) {
    std::size_t size = 1;
    try {
      size = simulation.read(variable).size();
    } catch (const client::Error&) {  // a formula, which is one number
    }
    for (std::size_t k = 1; k <= size; ++k)
      names.push_back(size == 1 ? variable : variable + "[" + std::to_string(k) + "]");
  }
  return names;
}

/// Ends a peer when its simulation is gone, which an idle stream does not tell.
class SimulationWatch {
 public:
  SimulationWatch(client::Server& server, const std::string& name, client::Peer& peer)
      : simulation_(server.find(name)), peer_(peer), thread_([this] { run(); }) {}
  ~SimulationWatch() {
    stop_.stop();
    thread_.join();
  }
  SimulationWatch(const SimulationWatch&) = delete;
  SimulationWatch& operator=(const SimulationWatch&) = delete;

 private:
  void run() {
    while (!stop_.stopped_within(std::chrono::seconds(1))) {
      try {
        (void)simulation_.read("time");
      } catch (const std::exception&) {
        return peer_.interrupt();
      }
    }
  }

  client::Simulation simulation_;
  client::Peer& peer_;
  server::StopSignal stop_;
  std::thread thread_;
};

// ------------------------------------------------------------------ MBDyn's protocol

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
  if (layout.node_labels.empty() && layout.mode_numbers.empty())
    throw std::runtime_error("the port has neither nodes nor modes");
  form.rotation = kRotations.at(call.rotation);
  form.labels = call.labels;
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
  return form;
}

mbdyn::ForceState state_of(const mbdyn::ForceForm& form, const client::Motion& motion) {
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

}  // namespace

client::Server connect(const PeerCall& call) {
  client::Credentials credentials;
  credentials.token = text_of_file(call.token_file);
  if (!call.server_ca.empty()) credentials.server_ca = text_of_file(call.server_ca) + "\n";
  return client::Server::connect(call.server, 10, credentials);
}

client::PeerOptions options_of(const PeerCall& call) {
  client::PeerOptions options;
  options.mode = mode_of(call.mode);
  options.timeout = call.timeout + 1;  // ours ends first and says why
  return options;
}

void serve_fmu(const PeerCall& call, const FmuCall& fmu) {
  const FmuArchive archive(fmu.file);
  client::Server server = connect(call);
  client::Simulation simulation = server.find(call.simulation);
  client::PeerOptions options = options_of(call);
  if (!archive.keeps_states()) {
    if (options.mode == Mode::tight || options.mode == Mode::window)
      throw std::runtime_error(
          "the FMU cannot go back to a state: it takes part in explicit "
          "modes only, --mode loose or staggered");
    std::fprintf(stderr, "note: the FMU cannot go back to a state; the coupling is explicit\n");
    if (options.mode == Mode::port_default) options.mode = Mode::loose;
  }
  FmuPeer* running = nullptr;
  options.step_ended = [&](bool accepted, std::int64_t, double) {
    if (running) running->step_ended(accepted);
  };
  client::Peer peer = simulation.attach(call.port, options);
  const PortSignals signals{expanded(simulation, peer.layout().outputs),
                            expanded(simulation, peer.layout().inputs)};
  SignalMap map = map_signals(archive, signals, fmu.map);
  for (const auto& [name, start] : map.unset)
    std::fprintf(stderr, "note: nothing sets the FMU's input \"%s\"; it keeps its start value %s\n",
                 name.c_str(), start.c_str());
  const auto controller = make_controller(archive);
  FmuPeer host(*controller, std::move(map), archive.keeps_states(), simulation.read("time").at(0));
  running = &host;
  std::printf("%s: FMI %s, attached to port \"%s\"\n", archive.name().c_str(),
              archive.is_fmi3() ? "3.0" : "2.0", call.port.c_str());
  std::fflush(stdout);
  const SimulationWatch watch(server, call.simulation, peer);
  client::Motion motion;
  while (peer.next(motion)) {
    try {
      peer.answer({.signals = host.exchange(motion)});
    } catch (const std::exception& e) {
      peer.fail(archive.name() + ": " + e.what());
    }
  }
}

void serve_socket(const PeerCall& call, const SocketCall& socket) {
  const mbdyn::Patience patience{
      .time = std::chrono::milliseconds(static_cast<long long>(1000 * call.timeout))};
  client::Server server = connect(call);
  client::Simulation simulation = server.find(call.simulation);
  client::PeerOptions options = options_of(call);
  options.accelerations = socket.accelerations;
  const std::string name = "the code at " + mbdyn::text_of(socket.address);
  const auto end = mbdyn::Clock::now() + patience.time;
  std::unique_ptr<mbdyn::Link> link;
  if (socket.address.create) {
    mbdyn::Listener listener(socket.address, name);
    std::printf("waiting for a code on %s\n", mbdyn::text_of(socket.address).c_str());
    std::fflush(stdout);
    link = listener.accept(end, patience);
  } else {
    link = mbdyn::connect_to(socket.address, name, end, patience);
  }
  client::Peer peer = simulation.attach(call.port, options);
  const mbdyn::ForceForm form = form_of(peer.layout(), socket);
  mbdyn::SocketWire wire(std::move(link), form, socket.address.create);
  SocketAnswers answers(wire, form);
  const SimulationWatch watch(server, call.simulation, peer);
  client::Motion motion;
  while (!answers.ended() && peer.next(motion)) {
    try {
      peer.answer(answers.answer(motion));
    } catch (const mbdyn::ChannelLost& lost) {
      peer.fail(lost.what());
      throw;
    }
  }
  wire.end(mbdyn::Clock::now() + patience.farewell);
}

}  // namespace mbcosim::peer
