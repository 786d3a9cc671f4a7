/// What sessions and their parts share, for tests.
#pragma once

#include "service/session_shared.h"

namespace mbcosim::server {

struct SharedParts {
  explicit SharedParts(int slots) : slots(slots) {}
  SolverSlots slots;
  ServiceLimits limits;
  Metrics metrics;
  EventLog log;
  MemoryBudget memory{1 << 30};
  Lanes lanes{1, 1};
  Timer timer;
  SessionShared shared{slots, limits, metrics, log, memory, lanes, timer};
};

}  // namespace mbcosim::server
