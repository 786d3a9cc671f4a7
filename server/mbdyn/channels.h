/// All channels of a deck, carried out: `mbcosim run` obeys the sockets and files that a deck
/// names.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "mbdyn/force_dialogue.h"
#include "mbdyn/link.h"
#include "mbdyn/stream.h"
#include "mbdyn/text_socket.h"

namespace mbcosim::mbdyn {

/// The files that carrying out this channel writes, replaces or removes.
std::vector<std::string> files_changed_by(const DeckChannel& channel);

/// Channels of a prepared simulation. Every wait ends within the patience; what goes wrong is
/// thrown as ChannelLost, out of `Simulation::step` and `start`, too, and names the channel.
class Channels {
 public:
  /// Opens and connects all: listening sockets first, so that codes may come in any order.
  Channels(const std::vector<const DeckChannel*>& channels, Simulation& simulation,
           const Patience& patience, bool pads_labels = false);
  ~Channels();
  Channels(const Channels&) = delete;
  Channels& operator=(const Channels&) = delete;

  /// Starts the simulation, and takes steps; like the methods of the same name.
  Status start(const CancelToken* cancel);
  StepReport step(const CancelToken* cancel);

  // --- the parts of `step`, for who takes the steps with callbacks of their own
  void step_begins();
  /// Before each residual, with the number of corrections; false: a code is not done.
  bool exchange(int iteration, bool in_derivatives = false);
  void attempt_failed();  ///< another follows
  void converged();       ///< the step is accepted

  /// A code has asked for the end of the run: its name.
  std::optional<std::string> wants_end() const;
  /// Tells the codes that the run is over.
  void end();

 private:
  void open(const DeckChannel& channel, std::unique_ptr<Link> link);
  void observe(StartEvent event);

  Simulation& simulation_;
  const Patience patience_;
  const bool pads_labels_;  ///< see ForceForm
  std::vector<std::unique_ptr<ForceDialogue>> forces_;
  std::vector<std::unique_ptr<StreamSender>> senders_;
  std::vector<std::unique_ptr<StreamReceiver>> receivers_;
  std::vector<std::unique_ptr<TextSocket>> text_sockets_;
  bool ended_ = false;
};

}  // namespace mbcosim::mbdyn
