// Runs a deck in this process, step by step, and prints the kinetic energy of node 1's unit mass as
// it goes.
//
// usage: energy DECK [STEPS]
#include <cstdio>
#include <string>
#include <vector>

#include "simulation/simulation.h"

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "usage: energy DECK [STEPS]\n");
    return 4;
  }
  const std::string path = argv[1];
  const std::size_t slash = path.rfind('/');
  const std::string folder = slash == std::string::npos ? "." : path.substr(0, slash);
  const mbcosim::LoadReport deck =
      mbcosim::load_deck(mbcosim::FolderSource(folder), path.substr(slash + 1));
  for (const mbcosim::Diagnostic& d : deck.diagnostics)
    std::fprintf(stderr, "%s\n", d.text().c_str());
  if (!deck.ok()) return 2;

  auto created = mbcosim::Simulation::create(deck.model);
  if (!created) {
    std::fprintf(stderr, "error: %s\n", created.error().message.c_str());
    return 3;
  }
  mbcosim::Simulation& simulation = **created;
  const int velocity = simulation.find_variable("node.structural.1.XP");
  if (velocity < 0) {
    std::fprintf(stderr, "error: the deck has no structural node 1\n");
    return 2;
  }
  const long steps = argc > 2 ? std::atol(argv[2]) : 10;
  for (long i = 0; i < steps; ++i) {
    const mbcosim::StepReport report = simulation.step();
    if (report.error) {
      std::fprintf(stderr, "error: %s\n", report.error->message.c_str());
      return 3;
    }
    std::vector<double> v;
    simulation.get(velocity, v);
    std::printf("%8.4f s  %.9g J/kg\n", report.time,
                0.5 * (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]));
  }
  return 0;
}
