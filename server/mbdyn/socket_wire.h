/// An external force's messages over a socket.
#pragma once

#include <memory>

#include "mbdyn/force_dialogue.h"
#include "mbdyn/link.h"

namespace mbcosim::mbdyn {

class SocketWire : public ForceWire {
 public:
  /// Shakes hands: with `listened` the peer asks and is answered, otherwise we ask and say at once
  /// that it is accepted, as MBDyn does. Throws ChannelLost with every mismatch. `form` is that of
  /// the port; the peer's own flags may change how labels are padded.
  SocketWire(std::unique_ptr<Link> link, ForceForm form, bool listened);
  void send(Command command, const ForceState& state) override;
  Command receive(ForceLoads& loads) override;
  void end(Clock::time_point until) override;

 private:
  void answer_request();

  std::unique_ptr<Link> link_;
  ForceForm form_;
};

}  // namespace mbcosim::mbdyn
