/// Sockets that decks name, served by the daemon where its operator has given a folder for them.
#pragma once

#include <atomic>
#include <chrono>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "mbcosim/v1/simulations.pb.h"
#include "mbdyn/channels.h"

namespace mbcosim::server {

class DeckSockets;

/// The one folder in which decks may listen and connect: Unix sockets, and nothing else. Bounds how
/// many there are. Thread-safe.
class DeckSocketFolder {
 public:
  /// `path` empty: no deck opens a socket. `most`: sockets at once. `listeners`: the daemon's own
  /// addresses. Throws std::runtime_error when the folder cannot be used.
  DeckSocketFolder(const std::string& path, int most, const std::vector<std::string>& listeners);

  /// Listens and connects for the deck of a simulation that is not started yet, and waits for the
  /// codes. Throws DECK_SOCKETS for what the operator does not allow, BAD_ARGUMENT, LIMIT_EXCEEDED,
  /// PEER_LOST.
  std::unique_ptr<DeckSockets> open(Simulation& simulation, const v1::DeckSocketOptions& options,
                                    const CancelToken& token);

 private:
  friend class DeckSockets;
  class Share;    ///< of the sockets that there may be
  class Waiting;  ///< for codes, before the start
  DeckChannel allowed(const DeckChannel& channel) const;
  std::string without_path(std::string text) const;

  std::string path_;  ///< canonical
  const int most_;
  std::atomic<int> used_{0}, waiting_{0};
};

/// The sockets of one simulation, which outlives them. Used by the thread that advances it, with
/// its lock. Codes cannot go back: what is lost once stays lost.
class DeckSockets {
 public:
  ~DeckSockets();
  /// Initial assembly and what follows, with the codes. Throws PEER_LOST.
  Status start(const CancelToken& token);
  /// Names of the ports that belong to the codes.
  static std::set<std::string> ports(const Model& model);

  /// A new step, or another attempt at it. These throw PeerLost.
  void begin(const CancelToken& token);
  bool exchange(int iteration, const CancelToken& token);
  /// For codes, since the last `start_clock` [s].
  double waited_seconds() const { return waited_; }
  void start_clock() { waited_ = 0; }
  void attempt_failed() { channels_->attempt_failed(); }
  /// Does not throw: a code that is lost here fails the next step.
  void accepted(const CancelToken& token);
  /// Parts with the codes and closes the sockets; the simulation was deleted.
  void end();

 private:
  friend class DeckSocketFolder;
  DeckSockets(DeckSocketFolder& folder, Simulation& simulation,
              const std::vector<DeckChannel>& channels, mbdyn::Patience patience, bool pads_labels,
              const CancelToken& token);
  template <class Work>
  void guarded(const CancelToken& token, Work&& work);
  void check() const;

  DeckSocketFolder& folder_;
  Simulation& simulation_;
  std::unique_ptr<DeckSocketFolder::Share> share_;
  std::atomic<const CancelToken*> token_{nullptr};  ///< of the call that waits
  std::unique_ptr<mbdyn::Channels> channels_;
  std::int64_t begun_for_ = -1;  ///< number of accepted steps when the last step began
  double waited_ = 0;
  std::string lost_;  ///< why nothing is exchanged any more; empty: all is well
};

}  // namespace mbcosim::server
