// A spring computed outside of the server: hangs the body of a deck on it and prints how it swings.
//
// usage: spring_peer ADDRESS DECK NODE [STEPS]
//        spring_peer ADDRESS --join SIMULATION PORT [--shared-memory]
//
// e.g. spring_peer unix:/tmp/mbcosim.sock rigid_body.mbd 1; the second form takes part in a
// simulation that another client steps.
#include <cstdio>
#include <cstdlib>
#include <string>

#include "client/mbcosim_client.h"

namespace client = mbcosim::client;

namespace {

constexpr double kStiffness = 400;  // [N/m]

client::Loads spring(const client::Motion& motion) {
  client::Loads loads;
  for (const double x : motion.x) loads.forces.push_back(-kStiffness * x);
  return loads;
}

// Callback use: the peer's own thread answers while this one steps.
int hang(const char* address, const char* deck, const char* node, long steps) {
  client::Server server = client::Server::connect(address);
  client::LoadOptions options;
  options.ports = {{.name = "spring", .nodes = {std::atoi(node)}}};
  client::Simulation simulation = server.load(deck, options);

  client::PeerOptions implicit;
  implicit.mode = client::Mode::window;
  implicit.acceleration = client::Acceleration::iqn_ils;
  const client::Peer peer = simulation.couple("spring", spring, implicit);

  const std::string position = std::string("node.structural.") + node + ".X";
  for (long done = 0; done < steps; done += 10) {
    const client::StepResult result = simulation.step(10);
    if (!result.ok()) {
      std::fprintf(stderr, "error: %s\n", result.failure.c_str());
      return 3;
    }
    const std::vector<double> x = simulation.read(position);
    std::printf("%8.4f s  %10.6f %10.6f %10.6f m\n", result.time, x[0], x[1], x[2]);
  }
  std::printf("%lld exchanges\n", static_cast<long long>(peer.exchanges()));
  return 0;
}

// Synchronous use: answers until the simulation is gone.
int join(const char* address, const char* name, const char* port, bool shared_memory) {
  client::Server server = client::Server::connect(address);
  client::Simulation simulation = server.find(name);
  client::PeerOptions options;
  options.mode = client::Mode::tight;
  if (shared_memory) options.transport = client::Transport::shared_memory;
  client::Peer peer = simulation.attach(port, options);
  client::Motion motion;
  while (peer.next(motion)) peer.answer(spring(motion));
  std::printf("%lld exchanges\n", static_cast<long long>(peer.exchanges()));
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  const bool joins = argc > 4 && std::string(argv[2]) == "--join";
  const bool shared_memory = argc == 6 && std::string(argv[5]) == "--shared-memory";
  if (argc < 4 || argc > (joins ? 5 + shared_memory : 5)) {
    std::fprintf(stderr,
                 "usage: spring_peer ADDRESS DECK NODE [STEPS]\n"
                 "       spring_peer ADDRESS --join SIMULATION PORT [--shared-memory]\n");
    return 4;
  }
  try {
    if (joins) return join(argv[1], argv[3], argv[4], shared_memory);
    return hang(argv[1], argv[2], argv[3], argc > 4 ? std::atol(argv[4]) : 100);
  } catch (const client::Error& error) {
    std::fprintf(stderr, "error: %s\n", error.what());
    return 3;
  }
}
