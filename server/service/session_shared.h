/// What all sessions of a daemon share.
#pragma once

#include "rpc/lanes.h"
#include "service/config.h"
#include "service/event_log.h"
#include "service/fair_mutex.h"
#include "service/metrics.h"
#include "threads/timer.h"
#include "wire/memory.h"

namespace mbcosim::server {

/// All of it outlives the sessions.
struct SessionShared {
  SolverSlots& slots;
  const ServiceLimits& limits;
  Metrics& metrics;
  EventLog& log;
  MemoryBudget& memory;
  Lanes& lanes;
  Timer& timer;
};

}  // namespace mbcosim::server
