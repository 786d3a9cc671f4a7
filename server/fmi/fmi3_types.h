/// Types of FMI 3.0.2, declared from the text of the standard (chapters 2.2, 2.3 and 4.2).
#pragma once

#include <cstddef>
#include <cstdint>

namespace mbcosim::fmi3 {

using Handle = void*;
using Environment = void*;
using StateHandle = void*;
using Reference = std::uint32_t;
using Float32 = float;
using Float64 = double;
using Boolean = bool;
using String = const char*;
using Byte = std::uint8_t;
using Binary = const Byte*;
using Clock = bool;
using Code = int;            ///< OK, Warning, Discard, Error, Fatal from 0
using DependencyKind = int;  ///< Independent, Constant, Fixed, Tunable, Discrete, Dependent from 0
using IntervalQualifier = int;  ///< NotYetKnown, Unchanged, Changed from 0

using LogMessage = void (*)(Environment, Code, String category, String message);
using IntermediateUpdate = void (*)(Environment, Float64 time, Boolean set_requested,
                                    Boolean get_allowed, Boolean step_finished,
                                    Boolean can_return_early, Boolean* early_return_requested,
                                    Float64* early_return_time);
using ClockUpdate = void (*)(Environment);
using Preemption = void (*)();

}  // namespace mbcosim::fmi3
