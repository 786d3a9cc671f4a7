/// MBDyn's streams: values that a deck sends after steps, values that it reads before them.
#pragma once

#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include "mbdyn/link.h"
#include "simulation/simulation.h"

namespace mbcosim::mbdyn {

/// `stream output`, `stream motion output`. A broken one is told once and sends no more; with
/// `abort if broken` it ends the run.
class StreamSender {
 public:
  StreamSender(const DeckChannel& channel, const Simulation& simulation,
               std::unique_ptr<Link> link);
  void start(const Simulation& simulation);
  void converged(const Simulation& simulation);
  bool wants_end() const { return wants_end_; }
  const std::string& name() const { return channel_.card; }

 private:
  void send(const Simulation& simulation);
  void write_echo(const std::vector<double>& values);

  const DeckChannel channel_;
  std::unique_ptr<Link> link_;  ///< null when broken
  std::ofstream echo_;
  int handle_ = -1;
  long steps_ = 0;  ///< since the start, dummy steps included
  bool wants_end_ = false;
};

/// File driver `stream`. When the peer closes, the last values stay to the end of the run; when it
/// is `non blocking`, they hold until a message is whole.
class StreamReceiver {
 public:
  StreamReceiver(const DeckChannel& channel, const Simulation& simulation,
                 std::unique_ptr<Link> link);
  void start(Simulation& simulation);        ///< before everything
  void step_begins(Simulation& simulation);  ///< once, whatever becomes of its attempts

 private:
  void receive(Simulation& simulation);
  bool has_message();  ///< waits for it, or not, as the channel is
  void write_echo(const Simulation& simulation, const std::vector<double>& values);

  const DeckChannel channel_;
  std::unique_ptr<Link> link_;  ///< null when closed
  std::string message_;         ///< its first `received_` bytes have come
  std::size_t received_ = 0;
  std::ofstream echo_;
  std::vector<double> last_;
  int handle_ = -1, count_ = 0;
  long steps_ = 0;
};

}  // namespace mbcosim::mbdyn
