#include <cstdio>
#include <stdexcept>

#include "peer/fmu_peer.h"
#include "peer/options.h"
#include "peer/simulation_watch.h"

namespace mbcosim::peer {
namespace {

using client::Mode;

Mode mode_of(const std::string& name) {
  if (name == "loose") return Mode::loose;
  if (name == "staggered") return Mode::staggered;
  if (name == "tight") return Mode::tight;
  if (name == "window") return Mode::window;
  return Mode::port_default;
}

}  // namespace

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

client::PeerOptions options_of(const PeerCall& call) {
  client::PeerOptions options;
  options.mode = mode_of(call.mode);
  options.timeout = call.timeout + 1;  // ours ends first and says why
  return options;
}

bool next_exchange(const PeerCall& call, client::Peer& peer, client::Motion& motion) {
  try {
    return peer.next(motion);
  } catch (const client::Error& error) {
    if (call.interrupted() || error.reason() == "NO_SUCH_SIMULATION") return false;
    throw Lost(std::string("the connection to the simulation is lost: ") + error.what());
  }
}

void require_good_end(client::Server& server, const PeerCall& call, const client::Peer& peer) {
  if (call.interrupted()) return;
  try {
    if (const auto error = peer.error()) throw *error;
    (void)server.find(call.simulation);
  } catch (const client::Error& error) {
    if (error.reason() == "NO_SUCH_SIMULATION") return;
    throw Lost(std::string("the connection to the simulation is lost: ") + error.what());
  }
  throw Lost("the connection to the simulation is lost: the daemon ended it");
}

void serve_fmu(const PeerCall& call, const FmuCall& fmu) {
  const FmuArchive archive(fmu.file);
  if (call.interrupted()) return;
  client::Server server = server::reach(call.daemon);
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
  options.step_ended = [&](bool accepted, std::int64_t step, double) {
    if (running) running->step_ended(accepted, step);
  };
  client::Peer peer = simulation.attach(call.port, options);
  if (peer.layout().modal || !peer.layout().node_labels.empty())
    throw std::runtime_error("port \"" + call.port +
                             "\" is no signal port: an FMU takes part in those only");
  const PortSignals signals{expanded(simulation, peer.layout().outputs),
                            expanded(simulation, peer.layout().inputs)};
  SignalMap map = map_signals(archive, signals, fmu.map);
  for (const auto& [name, start] : map.unset)
    std::fprintf(stderr, "note: nothing sets the FMU's input \"%s\"; it keeps its start value %s\n",
                 name.c_str(), start.c_str());
  const auto controller = make_controller(archive);
  FmuPeer host(*controller, std::move(map), archive.keeps_states(), simulation.read("time").at(0));
  running = &host;
  const SimulationWatch watch(call, server, peer);
  std::printf("%s: FMI %s, attached to port \"%s\"\n", archive.name().c_str(),
              archive.is_fmi3() ? "3.0" : "2.0", call.port.c_str());
  std::fflush(stdout);
  client::Motion motion;
  while (next_exchange(call, peer, motion)) {
    try {
      peer.answer({.signals = host.exchange(motion)});
    } catch (const Lost& lost) {
      peer.fail(archive.name() + ": " + lost.what());
      throw;
    } catch (const std::exception& e) {
      peer.fail(archive.name() + ": " + e.what());
    }
  }
  require_good_end(server, call, peer);
}

}  // namespace mbcosim::peer
