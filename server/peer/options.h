/// What `mbcosim peer` is told.
#pragma once

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "client/mbcosim_client.h"
#include "model/deck_channel.h"
#include "reach/daemon_options.h"
#include "solver/cancel.h"

namespace mbcosim::peer {

/// Where the simulation is and how the peer takes part.
struct PeerCall {
  server::DaemonOptions daemon;
  std::string simulation, port;
  std::string mode;                        ///< loose, staggered, tight, window; empty: the port's
  double timeout = 60;                     ///< longest wait for the other side [s]
  const CancelToken* interrupt = nullptr;  ///< cancelled by a signal
  bool interrupted() const { return interrupt && interrupt->cancelled(); }
};

struct FmuCall {
  std::string file;
  std::map<std::string, std::string> map;  ///< name in the FMU -> name of the signal
};

struct SocketCall {
  std::string protocol;  ///< "mbdyn": that of MBDyn's external forces and streams
  ChannelAddress address;
  std::optional<ChannelAddress> inputs;  ///< signal port: of a link of their own
  std::string rotation = "matrix";       ///< none, vector, matrix, euler123
  bool labels = false, accelerations = false;
  bool unsorted = false;                ///< labels of the points, in any order
  bool pads_labels = false;             ///< the code pads labels of an odd number of points
  bool global_reference_loads = false;  ///< those on the reference node are not in its frame
};

/// The daemon or the FMU is lost. The text says why.
class Lost : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Times of the simulation that differ by less are equal [s].
inline double tolerance_at(double time) { return 1e-9 * std::max(1.0, std::abs(time)); }

/// Each serves until the simulation is gone or a signal comes (`call.interrupted()`). Throw
/// std::exception.
void serve_fmu(const PeerCall& call, const FmuCall& fmu);
void serve_socket(const PeerCall& call, const SocketCall& socket);

client::PeerOptions options_of(const PeerCall& call);
/// The next exchange; false: the stream has ended. Throws Lost.
bool next_exchange(const PeerCall& call, client::Peer& peer, client::Motion& motion);
/// Of a peer whose stream has ended. Throws Lost unless the simulation is gone in good order or a
/// signal came.
void require_good_end(client::Server& server, const PeerCall& call, const client::Peer& peer);
/// A name for each number of these variables.
std::vector<std::string> expanded(const client::Simulation& simulation,
                                  const std::vector<std::string>& variables);

}  // namespace mbcosim::peer
