// A spring computed outside of the server: hangs the body of a deck on it and prints how it swings.
//
// usage: spring_peer ADDRESS DECK NODE [STEPS]     e.g. spring_peer unix:/tmp/mbcosim.sock
// tumbling.mbd 1
#include <cstdio>
#include <cstdlib>
#include <string>

#include "client/mbcosim_client.h"

namespace client = mbcosim::client;

int main(int argc, char** argv) {
  if (argc < 4) {
    std::fprintf(stderr, "usage: spring_peer ADDRESS DECK NODE [STEPS]\n");
    return 4;
  }
  const long steps = argc > 4 ? std::atol(argv[4]) : 100;
  const double stiffness = 400;  // [N/m]
  try {
    client::Server server = client::Server::connect(argv[1]);
    client::LoadOptions options;
    options.ports = {{.name = "spring", .nodes = {std::atoi(argv[3])}}};
    client::Simulation simulation = server.load(argv[2], options);

    const auto spring = [&](const client::Motion& motion) {
      client::Loads loads;
      for (const double x : motion.x) loads.forces.push_back(-stiffness * x);
      return loads;
    };
    client::PeerOptions implicit;
    implicit.mode = client::Mode::window;
    implicit.acceleration = client::Acceleration::iqn_ils;
    const client::Peer peer = simulation.couple("spring", spring, implicit);

    const std::string position = std::string("node.structural.") + argv[3] + ".X";
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
  } catch (const client::Error& error) {
    std::fprintf(stderr, "error: %s\n", error.what());
    return 3;
  }
  return 0;
}
