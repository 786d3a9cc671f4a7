/// What the participant is told on its command line.
#pragma once

#include <string>
#include <vector>

#include "client/mbcosim_client.h"

/// Names of the data in preCICE's configuration; empty: not exchanged.
struct DataNames {
  std::string force, moment;           ///< read: [N], [N·m] about the points
  std::string displacement, velocity;  ///< written: [m] since the start, [m/s]
};

struct Options {
  std::string address;        ///< of the daemon: "unix:PATH" or "HOST:PORT"
  std::string configuration;  ///< preCICE's, a file
  std::string participant, mesh;
  std::string deck, simulation;  ///< one of them: a deck to load, or what another client has loaded
  std::string port;        ///< that the deck or the other client names; empty: `nodes` tell it
  std::vector<int> nodes;  ///< labels of the nodes of a port that is made for the deck
  DataNames data;
  mbcosim::client::Credentials credentials;  ///< towards the daemon
};

extern const char* const kUsage;

/// Throws std::invalid_argument, whose text says what is wrong.
Options read_options(int argc, const char* const* argv);
