/// Types of FMI 2.0.4, declared from the text of the standard (chapters 2.1 and 4.2).
#pragma once

#include <cstddef>

namespace mbcosim::fmi2 {

using Component = void*;
using Environment = void*;
using StateHandle = void*;
using Reference = unsigned int;
using Real = double;
using Integer = int;
using Boolean = int;
using Char = char;
using String = const Char*;
using Byte = char;
using Code = int;        ///< OK, Warning, Discard, Error, Fatal, Pending from 0
using Type = int;        ///< ModelExchange 0, CoSimulation 1
using StatusKind = int;  ///< DoStepStatus, PendingStatus, LastSuccessfulTime, Terminated from 0

struct Callbacks {
  void (*logger)(Environment, String instance, Code, String category, String message, ...);
  void* (*allocate)(std::size_t, std::size_t);
  void (*free)(void*);
  void (*step_finished)(Environment, Code);
  Environment environment;
};

struct EventInfo {
  Boolean new_discrete_states_needed, terminate_simulation, nominals_changed, values_changed,
      next_event_time_defined;
  Real next_event_time;
};

}  // namespace mbcosim::fmi2
