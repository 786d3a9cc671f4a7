/// What `mbcosim peer` is told.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "client/mbcosim_client.h"
#include "model/deck_channel.h"

namespace mbcosim::peer {

/// Where the simulation is and how the peer takes part.
struct PeerCall {
  std::string server;  ///< address of the daemon
  std::string token_file, server_ca;
  std::string simulation, port;
  std::string mode;     ///< loose, staggered, tight, window; empty: the port's
  double timeout = 60;  ///< longest wait for the other side [s]
};

struct FmuCall {
  std::string file;
  std::map<std::string, std::string> map;  ///< name in the FMU -> name of the signal
};

struct SocketCall {
  std::string protocol;  ///< "mbdyn": that of MBDyn's external forces
  ChannelAddress address;
  std::string rotation = "matrix";  ///< none, vector, matrix, euler123
  bool labels = false, accelerations = false;
};

/// Each serves until the simulation is gone. Throw std::exception.
void serve_fmu(const PeerCall& call, const FmuCall& fmu);
void serve_socket(const PeerCall& call, const SocketCall& socket);

/// The simulation, by what `call` says of the daemon.
client::Server connect(const PeerCall& call);
client::PeerOptions options_of(const PeerCall& call);

}  // namespace mbcosim::peer
