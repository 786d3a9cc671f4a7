/// The end of a simulation, for a peer that waits.
#pragma once

#include <chrono>
#include <string>
#include <thread>

#include "client/mbcosim_client.h"
#include "threads/mutex.h"

namespace mbcosim::peer {

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

}  // namespace mbcosim::peer
