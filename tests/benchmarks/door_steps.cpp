/// What a C++ program waits for at the daemon's doors; doors.py runs it.
///
/// usage: door_steps ADDRESS DECK call|stream|peer|shared_memory COUNT
///
/// call           a step asked for by a call
/// stream         a step asked for on an open stream
/// peer           a step with a code on port "points", two exchanges in each
/// shared_memory  the same through shared memory
///
/// Prints the median and the 99 % quantile of COUNT steps [µs].
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "client/mbcosim_client.h"

namespace {

namespace client = mbcosim::client;
using Clock = std::chrono::steady_clock;

/// Without the first ones.
template <class Step>
std::vector<double> sample(int count, Step&& step) {
  std::vector<double> samples;
  for (int k = -count / 10; k < count; ++k) {
    const Clock::time_point start = Clock::now();
    step();
    if (k >= 0)
      samples.push_back(std::chrono::duration<double, std::micro>(Clock::now() - start).count());
  }
  std::sort(samples.begin(), samples.end());
  return samples;
}

/// The same loads always; done with the second answer of a step.
client::Loads push(const client::Motion& motion) {
  const std::size_t points = motion.x.size() / 3;
  client::Loads loads;
  loads.forces.assign(3 * points, 0.0);
  loads.forces[0] = 1.0;
  loads.unfinished = motion.iteration == 1;
  return loads;
}

std::vector<double> steps_with_a_peer(client::Simulation& simulation, client::Transport transport,
                                      int count) {
  client::PeerOptions options;
  options.mode = client::Mode::tight;
  options.transport = transport;
  const client::Peer peer = simulation.couple("points", push, options);
  client::Stepper stepper = simulation.stepper();
  return sample(count, [&] { (void)stepper.step(); });
}

std::vector<double> measure(client::Simulation& simulation, const std::string& door, int count) {
  if (door == "call") return sample(count, [&] { (void)simulation.step(); });
  if (door == "stream") {
    client::Stepper stepper = simulation.stepper();
    return sample(count, [&] { (void)stepper.step(); });
  }
  return steps_with_a_peer(
      simulation, door == "peer" ? client::Transport::stream : client::Transport::shared_memory,
      count);
}

}  // namespace

int main(int count, char** arguments) try {
  if (count != 5) throw std::runtime_error("usage: door_steps ADDRESS DECK DOOR COUNT");
  client::Server server = client::Server::connect(arguments[1]);
  client::Simulation simulation = server.load(arguments[2]);
  const std::vector<double> samples = measure(simulation, arguments[3], std::atoi(arguments[4]));
  std::printf("%.1f %.1f\n", samples[samples.size() / 2], samples[samples.size() * 99 / 100]);
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "door_steps: %s\n", error.what());
  return 1;
}
