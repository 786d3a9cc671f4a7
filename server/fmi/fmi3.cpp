/// The functions of FMI 3.0 for co-simulation. Names and arguments are the standard's.
#include <cstdint>

#include "fmi/fmi3_types.h"
#include "fmi/guard.h"

using namespace mbcosim::fmi;
using namespace mbcosim::fmi3;

namespace {

Log make_log(LogMessage message, Environment environment, bool on) {
  if (!message) return {{}, on};
  return {[=](Status status, const char* category, const char* text) {
            message(environment, static_cast<Code>(status), category, text);
          },
          on};
}

Handle refuse(const char* why, const Log& log) {
  log.write(Status::error, why);
  return nullptr;
}

}  // namespace

extern "C" {

const char* fmi3GetVersion() { return "3.0"; }

Code fmi3SetDebugLogging(Handle instance, Boolean on, std::size_t count,
                         const String categories[]) {
  return guarded(instance, Call::set_debug_logging, "fmi3SetDebugLogging",
                 [&](Instance& core) { return switch_logging(core, on, count, categories); });
}

Handle fmi3InstantiateCoSimulation(String name, String token, String resources, Boolean,
                                   Boolean logging, Boolean event_mode, Boolean, const Reference[],
                                   std::size_t intermediate, Environment environment,
                                   LogMessage message, IntermediateUpdate) {
  const Log log = make_log(message, environment, logging);
  if (event_mode) return refuse("there is no event mode; modelDescription.xml says so", log);
  if (intermediate > 0) return refuse("no variable takes part in intermediate updates", log);
  return instantiate(Standard::fmi3, name, token, resources, log);
}

Handle fmi3InstantiateModelExchange(String, String, String, Boolean, Boolean logging,
                                    Environment environment, LogMessage message) {
  return refuse("this FMU is for co-simulation", make_log(message, environment, logging));
}

Handle fmi3InstantiateScheduledExecution(String, String, String, Boolean, Boolean logging,
                                         Environment environment, LogMessage message, ClockUpdate,
                                         Preemption, Preemption) {
  return refuse("this FMU is for co-simulation", make_log(message, environment, logging));
}

void fmi3FreeInstance(Handle instance) { free_instance(instance, "fmi3FreeInstance"); }

Code fmi3EnterInitializationMode(Handle instance, Boolean, Float64, Float64 start,
                                 Boolean stop_defined, Float64 stop) {
  return guarded(instance, Call::enter_initialization, "fmi3EnterInitializationMode",
                 [&](Instance& core) {
                   const auto end = stop_defined ? std::optional(stop) : std::nullopt;
                   const Status status = core.setup(start, end);
                   return status == Status::ok ? core.enter_initialization() : status;
                 });
}

Code fmi3ExitInitializationMode(Handle instance) {
  return guarded(instance, Call::exit_initialization, "fmi3ExitInitializationMode",
                 [](Instance& core) { return core.exit_initialization(); });
}

Code fmi3Terminate(Handle instance) {
  return guarded(instance, Call::terminate, "fmi3Terminate",
                 [](Instance& core) { return core.terminate(); });
}

Code fmi3Reset(Handle instance) {
  return guarded(instance, Call::reset, "fmi3Reset", [](Instance& core) { return core.reset(); });
}

Code fmi3GetFloat64(Handle instance, const Reference references[], std::size_t count,
                    Float64 values[], std::size_t size) {
  return guarded(instance, Call::get, "fmi3GetFloat64", [&](Instance& core) {
    return core.get(array(references, count), array(values, size));
  });
}

Code fmi3SetFloat64(Handle instance, const Reference references[], std::size_t count,
                    const Float64 values[], std::size_t size) {
  return guarded(instance, Call::set, "fmi3SetFloat64", [&](Instance& core) {
    return core.set(array(references, count), array(values, size));
  });
}

Code fmi3GetInt32(Handle instance, const Reference references[], std::size_t count,
                  std::int32_t values[], std::size_t size) {
  return get_symbols(instance, "fmi3GetInt32", mbcosim::ValueType::integer,
                     array(references, count), array(values, size));
}

Code fmi3SetInt32(Handle instance, const Reference references[], std::size_t count,
                  const std::int32_t values[], std::size_t size) {
  return set_symbols(instance, "fmi3SetInt32", mbcosim::ValueType::integer,
                     array(references, count), array(values, size));
}

Code fmi3GetBoolean(Handle instance, const Reference references[], std::size_t count,
                    Boolean values[], std::size_t size) {
  return get_symbols(instance, "fmi3GetBoolean", mbcosim::ValueType::boolean,
                     array(references, count), array(values, size));
}

Code fmi3SetBoolean(Handle instance, const Reference references[], std::size_t count,
                    const Boolean values[], std::size_t size) {
  return set_symbols(instance, "fmi3SetBoolean", mbcosim::ValueType::boolean,
                     array(references, count), array(values, size));
}

Code fmi3GetString(Handle instance, const Reference references[], std::size_t count,
                   String values[], std::size_t size) {
  return get_symbols(instance, "fmi3GetString", mbcosim::ValueType::string,
                     array(references, count), array(values, size));
}

Code fmi3SetString(Handle instance, const Reference references[], std::size_t count,
                   const String values[], std::size_t size) {
  return set_symbols(instance, "fmi3SetString", mbcosim::ValueType::string,
                     array(references, count), array(values, size));
}

Code fmi3GetFMUState(Handle instance, StateHandle* state) {
  return guarded(instance, Call::state, "fmi3GetFMUState",
                 [&](Instance& core) { return save_state(core, state); });
}

Code fmi3SetFMUState(Handle instance, StateHandle state) {
  return guarded(instance, Call::state, "fmi3SetFMUState",
                 [&](Instance& core) { return restore_state(core, state); });
}

Code fmi3FreeFMUState(Handle instance, StateHandle* state) {
  return guarded(instance, Call::state, "fmi3FreeFMUState",
                 [&](Instance&) { return free_state(state); });
}

Code fmi3SerializedFMUStateSize(Handle instance, StateHandle state, std::size_t* size) {
  return guarded(instance, Call::state, "fmi3SerializedFMUStateSize",
                 [&](Instance& core) { return state_size(core, state, size); });
}

Code fmi3SerializeFMUState(Handle instance, StateHandle state, Byte bytes[], std::size_t size) {
  return guarded(instance, Call::state, "fmi3SerializeFMUState",
                 [&](Instance& core) { return serialize_state(core, state, bytes, size); });
}

Code fmi3DeserializeFMUState(Handle instance, const Byte bytes[], std::size_t size,
                             StateHandle* state) {
  return guarded(instance, Call::state, "fmi3DeserializeFMUState",
                 [&](Instance& core) { return deserialize_state(core, bytes, size, state); });
}

Code fmi3GetDirectionalDerivative(Handle instance, const Reference unknowns[],
                                  std::size_t unknown_count, const Reference knowns[],
                                  std::size_t known_count, const Float64 seed[],
                                  std::size_t seed_size, Float64 sensitivity[],
                                  std::size_t sensitivity_size) {
  return guarded(instance, Call::derivative, "fmi3GetDirectionalDerivative", [&](Instance& core) {
    return core.derivative(array(unknowns, unknown_count), array(knowns, known_count),
                           array(seed, seed_size), array(sensitivity, sensitivity_size), false);
  });
}

Code fmi3GetAdjointDerivative(Handle instance, const Reference unknowns[],
                              std::size_t unknown_count, const Reference knowns[],
                              std::size_t known_count, const Float64 seed[], std::size_t seed_size,
                              Float64 sensitivity[], std::size_t sensitivity_size) {
  return guarded(instance, Call::derivative, "fmi3GetAdjointDerivative", [&](Instance& core) {
    return core.derivative(array(unknowns, unknown_count), array(knowns, known_count),
                           array(seed, seed_size), array(sensitivity, sensitivity_size), true);
  });
}

Code fmi3DoStep(Handle instance, Float64 time, Float64 length, Boolean, Boolean* event_needed,
                Boolean* terminate, Boolean* early_return, Float64* last_time) {
  for (Boolean* flag : {event_needed, terminate, early_return})
    if (flag) *flag = false;
  return guarded(instance, Call::do_step, "fmi3DoStep", [&](Instance& core) {
    const Status status = core.do_step(time, length);
    if (last_time) *last_time = core.last_time();
    if (terminate) *terminate = core.ended();
    return status;
  });
}

}  // extern "C"
