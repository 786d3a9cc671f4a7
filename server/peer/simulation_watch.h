/// The end of a simulation, for a peer that waits.
#pragma once

#include <chrono>
#include <string>
#include <thread>

#include "client/mbcosim_client.h"
#include "peer/options.h"
#include "threads/mutex.h"

namespace mbcosim::peer {

/// Ends a peer when its simulation is gone, which an idle stream does not tell, or at a signal.
class SimulationWatch {
 public:
  SimulationWatch(const PeerCall& call, client::Server& server, client::Peer& peer)
      : call_(call),
        simulation_(server.find(call.simulation)),
        peer_(peer),
        asking_([this] { ask(); }),
        listening_([this] { listen(); }) {}
  ~SimulationWatch() {
    stop_.stop();
    asking_.join();
    listening_.join();
  }
  SimulationWatch(const SimulationWatch&) = delete;
  SimulationWatch& operator=(const SimulationWatch&) = delete;

 private:
  void ask() {
    constexpr int kTooLate = 4;  // DEADLINE_EXCEEDED: a long step is no end
    while (!stop_.stopped_within(std::chrono::seconds(1))) {
      try {
        (void)simulation_.read("time");
      } catch (const client::Error& error) {
        if (error.code() != kTooLate) return peer_.interrupt();
      } catch (const std::exception&) {
        return peer_.interrupt();
      }
    }
  }
  // Apart from the other, whose call may take long.
  void listen() {
    while (!stop_.stopped_within(std::chrono::milliseconds(100)))
      if (call_.interrupted()) return peer_.interrupt();
  }

  const PeerCall& call_;
  client::Simulation simulation_;
  client::Peer& peer_;
  server::StopSignal stop_;
  std::thread asking_, listening_;
};

}  // namespace mbcosim::peer
