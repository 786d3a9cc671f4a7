// A participant of preCICE whose solver is an mbcosim daemon: the points of a structural port are
// the mesh, forces come in, displacements and velocities go out. It steps the simulation and is the
// peer of the port; a time window that preCICE repeats starts again from a snapshot.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <memory>
#include <optional>

#include "surface.h"

namespace client = mbcosim::client;

namespace {

client::Simulation open_simulation(client::Server& server, const Options& options) {
  if (options.deck.empty()) return server.find(options.simulation);
  client::LoadOptions load;
  if (!options.nodes.empty()) load.ports = {{.name = "precice", .nodes = options.nodes}};
  return server.load(options.deck, load);
}

std::string port_of(const Options& options) {
  return options.port.empty() ? "precice" : options.port;
}

/// A loose peer is told the motion before the first step. It rejects the step, so that nothing has
/// happened.
client::Motion motion_at_start(client::Simulation& simulation, const std::string& port) {
  client::Motion start;
  const auto look = [&start](const client::Motion& motion) -> client::Loads {
    start = motion;
    throw client::Reject{.text = "preCICE's participant looks where the points are"};
  };
  client::Peer peer =
      simulation.couple(port, look, {.mode = client::Mode::loose, .frame = client::Frame::global});
  const client::StepResult result = simulation.step();
  peer.close();
  if (result.outcome != client::Outcome::rejected_by_peer)
    throw std::runtime_error("no motion of port \"" + port + "\": " + result.failure);
  if (start.x.empty()) throw std::runtime_error("port \"" + port + "\" has no nodes");
  return start;
}

/// Steps of the deck's length or a little shorter, such that the time window is a whole number of
/// them. `window`: what is left of it [s].
double length_of_step(double window, double deck) {
  constexpr double kRounding = 1e-9;  // relative: of sums of lengths
  return window / std::max(1.0, std::ceil(window / deck * (1 - kRounding)));
}

class Run {
 public:
  Run(client::Simulation& simulation, precice::Participant& participant, Surface& surface)
      : simulation_(simulation), participant_(participant), surface_(surface) {}
  Run(const Run&) = delete;
  Run& operator=(const Run&) = delete;
  /// The simulation may be another client's: the checkpoint goes also after a failure.
  ~Run() {
    if (!checkpoint_) return;
    try {
      simulation_.delete_snapshot(*checkpoint_);
    } catch (const client::Error& error) {
      std::fprintf(stderr, "warning: the checkpoint is left: %s\n", error.what());
    }
  }

  void until_the_end() {
    if (participant_.requiresInitialData()) surface_.write();
    participant_.initialize();
    while (participant_.isCouplingOngoing()) {
      if (participant_.requiresWritingCheckpoint()) save();
      participant_.advance(step());
      if (participant_.requiresReadingCheckpoint()) go_back();
      if (participant_.isTimeWindowComplete()) ++windows_;
    }
    participant_.finalize();
    std::printf("%ld time windows, %ld steps, %ld times back\n", windows_, steps_, returns_);
  }

 private:
  void save() {
    const std::optional<client::Snapshot> old = std::move(checkpoint_);
    checkpoint_ = simulation_.snapshot("preCICE");
    if (old) simulation_.delete_snapshot(*old);
  }

  void go_back() {
    simulation_.restore(checkpoint_.value());
    ++returns_;
  }

  /// Returns the length of the step [s].
  double step() {
    const client::SimulationInfo info = simulation_.refresh();
    if (info.state == client::SimulationInfo::finished)
      throw std::runtime_error("the deck ends at " + std::to_string(info.time) +
                               " s, before preCICE does: raise its \"final time\"");
    const double deck = info.next_step_size;
    const double length = length_of_step(participant_.getMaxTimeStepSize(), deck);
    client::StepOptions options;
    if (std::abs(length - deck) > 1e-9 * deck) options.step_size = length;
    surface_.begin_step(info.time, length);
    const client::StepResult result = simulation_.step(1, options);
    if (!result.ok())
      throw std::runtime_error("the step from " + std::to_string(info.time) +
                               " s failed: " + result.failure);
    ++steps_;
    surface_.write();
    return length;
  }

  client::Simulation& simulation_;
  precice::Participant& participant_;
  Surface& surface_;
  std::optional<client::Snapshot> checkpoint_;  ///< start of the time window; explicit: none
  long windows_ = 0, steps_ = 0, returns_ = 0;
};

/// The loads of a step do not depend on its iterates: each answer counts as it is.
client::PeerOptions tight_peer() {
  client::PeerOptions options;
  options.mode = client::Mode::tight;
  options.frame = client::Frame::global;
  options.tolerance = std::numeric_limits<double>::min();
  return options;
}

void couple(const Options& options, std::unique_ptr<precice::Participant>& participant) {
  client::Server server = client::Server::connect(options.address, 10, options.credentials);
  client::Simulation simulation = open_simulation(server, options);
  const client::Motion start = motion_at_start(simulation, port_of(options));
  participant = std::make_unique<precice::Participant>(options.participant, options.configuration,
                                                       /*solverProcessIndex=*/0,
                                                       /*solverProcessSize=*/1);
  Surface surface(*participant, options, start);
  const client::Peer peer = simulation.couple(
      port_of(options), [&surface](const client::Motion& motion) { return surface.answer(motion); },
      tight_peer());
  Run(simulation, *participant, surface).until_the_end();
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  try {
    options = read_options(argc, argv);
  } catch (const std::invalid_argument& error) {
    std::fprintf(stderr, "error: %s\n\n%s", error.what(), kUsage);
    return 4;
  }
  // It outlives a failure: its destructor may wait for the other participants (wait-in-finalize).
  // They learn of the end of this process by their connections.
  std::unique_ptr<precice::Participant> participant;
  try {
    couple(options, participant);
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "error: %s\n", error.what());
  }
  std::fflush(nullptr);
  std::_Exit(3);
}
