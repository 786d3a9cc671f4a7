/// What a peer and a port settle before they exchange anything.
#pragma once

#include <cstdint>
#include <string>

#include "coupling/agreement.h"
#include "coupling/port_model.h"
#include "wire/protocol.h"

namespace mbcosim::server {

/// What a peer may expect of the simulation besides the port.
struct Expected {
  std::string digest;     ///< of the model
  std::int64_t step = 0;  ///< the last accepted one
  double step_size = 0;   ///< of the next step [s]
};

/// Fills in what `hello` leaves open. Throws PORT_MISMATCH or VERSION_MISMATCH with everything that
/// does not fit, PEER_AHEAD when that is the step only.
Agreement agree(const v1::Hello& hello, const PortModel& port, const Expected& simulation);
/// `hello` with every choice filled in; `deck`: its units, null: not declared.
void fill_agreed(const v1::Hello& hello, const Agreement& agreement, const UnitSystem* deck,
                 v1::Hello* out);

}  // namespace mbcosim::server
