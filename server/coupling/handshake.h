/// What a peer and a port settle before they exchange anything.
#pragma once

#include <string>

#include "coupling/agreement.h"
#include "coupling/port_model.h"
#include "wire/protocol.h"

namespace mbcosim::server {

/// Fills in what `hello` leaves open. Throws PORT_MISMATCH or VERSION_MISMATCH with everything that
/// does not fit. `step_size`: of the next step [s].
Agreement agree(const v1::Hello& hello, const PortModel& port, const std::string& digest,
                double step_size);
/// `hello` with every choice filled in; `deck`: its units, null: not declared.
void fill_agreed(const v1::Hello& hello, const Agreement& agreement, const UnitSystem* deck,
                 v1::Hello* out);

}  // namespace mbcosim::server
