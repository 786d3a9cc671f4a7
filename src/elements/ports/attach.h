/// Ports that a client attaches to a deck that knows nothing of them.
#pragma once

#include <string>
#include <vector>

#include "elements/ports/port_element.h"
#include "model/diagnostic.h"

namespace mbcosim {

/// What is attached: imposed motion of structural nodes, or generalized forces on a modal joint.
struct PortAttachment {
  ElementPort::Kind kind = ElementPort::Kind::motion;  ///< motion or modal
  std::string name;
  std::vector<int> node_labels;  ///< motion
  bool positions_only = false;   ///< motion
  int modal_joint = 0;           ///< modal: label
};

/// Adds the element behind a port. ErrorKind::argument names what does not exist.
Status attach_port(ModelBuilder& builder, const PortAttachment& attachment);

}  // namespace mbcosim
