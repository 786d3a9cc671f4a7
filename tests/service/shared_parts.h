/// What sessions and their parts share, for tests.
#pragma once

#include "rpc/workers.h"
#include "service/session_shared.h"

namespace mbcosim::server {

struct SharedParts {
  explicit SharedParts(int slots) : slots(slots) {}
  SolverSlots slots;
  ServiceLimits limits;
  Metrics metrics;
  EventLog log;
  MemoryBudget memory{1 << 30};
  Workers workers{1, 1};
  SessionShared shared{slots, limits, metrics, log, memory, workers.lanes, workers.timer};
};

}  // namespace mbcosim::server
