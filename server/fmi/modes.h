/// The state machines of co-simulation in FMI 2 and FMI 3: which call is allowed when.
#pragma once

#include "fmi/status.h"

namespace mbcosim::fmi {

/// FMI 3's Step Mode is FMI 2's step complete. FMI 3 knows neither `set_up` (Instantiated, after
/// fmi2SetupExperiment) nor `step_failed` (after a discarded step it goes on) nor `failed` (it is
/// then Terminated).
enum class Mode { instantiated, set_up, initialization, step, step_failed, terminated, failed };

/// Freeing an instance is always allowed, and what modelDescription.xml rules out never.
enum class Call {
  set_debug_logging,
  setup_experiment,
  enter_initialization,
  exit_initialization,
  terminate,
  reset,
  get,
  set,
  state,  ///< get, set, free and (de)serialize FMU states
  derivative,
  do_step,
  step_status,
  count
};

bool is_allowed(Standard standard, Call call, Mode mode);
const char* mode_name(Standard standard, Mode mode);

}  // namespace mbcosim::fmi
