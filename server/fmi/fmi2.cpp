/// The functions of FMI 2.0 for co-simulation. Names and arguments are the standard's.
#include "fmi/fmi2_types.h"
#include "fmi/guard.h"

using namespace mbcosim::fmi;
using namespace mbcosim::fmi2;

namespace {

constexpr StatusKind kLastSuccessfulTime = 2, kTerminated = 3;
constexpr Type kCoSimulation = 1;

Log make_log(const std::string& name, const Callbacks* callbacks, bool on) {
  if (!callbacks || !callbacks->logger) return {{}, on};
  const auto logger = callbacks->logger;
  const Environment environment = callbacks->environment;
  return {[=](Status status, const char* category, const char* text) {
            logger(environment, name.c_str(), static_cast<Code>(status), category, "%s", text);
          },
          on};
}

}  // namespace

extern "C" {

const char* fmi2GetTypesPlatform() { return "default"; }
const char* fmi2GetVersion() { return "2.0"; }

Code fmi2SetDebugLogging(Component component, Boolean on, std::size_t count,
                         const String categories[]) {
  return guarded(component, Call::set_debug_logging, "fmi2SetDebugLogging",
                 [&](Instance& core) { return switch_logging(core, on != 0, count, categories); });
}

Component fmi2Instantiate(String name, Type type, String guid, String resources,
                          const Callbacks* callbacks, Boolean, Boolean logging) {
  const Log log = make_log(name ? name : "", callbacks, logging != 0);
  if (type == kCoSimulation) return instantiate(Standard::fmi2, name, guid, resources, log);
  log.write(Status::error, "this FMU is for co-simulation");
  return nullptr;
}

void fmi2FreeInstance(Component component) { free_instance(component, "fmi2FreeInstance"); }

Code fmi2SetupExperiment(Component component, Boolean, Real, Real start, Boolean stop_defined,
                         Real stop) {
  return guarded(component, Call::setup_experiment, "fmi2SetupExperiment", [&](Instance& core) {
    return core.setup(start, stop_defined ? std::optional(stop) : std::nullopt);
  });
}

Code fmi2EnterInitializationMode(Component component) {
  return guarded(component, Call::enter_initialization, "fmi2EnterInitializationMode",
                 [](Instance& core) { return core.enter_initialization(); });
}

Code fmi2ExitInitializationMode(Component component) {
  return guarded(component, Call::exit_initialization, "fmi2ExitInitializationMode",
                 [](Instance& core) { return core.exit_initialization(); });
}

Code fmi2Terminate(Component component) {
  return guarded(component, Call::terminate, "fmi2Terminate",
                 [](Instance& core) { return core.terminate(); });
}

Code fmi2Reset(Component component) {
  return guarded(component, Call::reset, "fmi2Reset", [](Instance& core) { return core.reset(); });
}

Code fmi2GetReal(Component component, const Reference references[], std::size_t count,
                 Real values[]) {
  return guarded(component, Call::get, "fmi2GetReal", [&](Instance& core) {
    return core.get(array(references, count), array(values, count));
  });
}

Code fmi2SetReal(Component component, const Reference references[], std::size_t count,
                 const Real values[]) {
  return guarded(component, Call::set, "fmi2SetReal", [&](Instance& core) {
    return core.set(array(references, count), array(values, count));
  });
}

Code fmi2GetInteger(Component component, const Reference references[], std::size_t count,
                    Integer values[]) {
  return get_symbols(component, "fmi2GetInteger", mbcosim::ValueType::integer,
                     array(references, count), array(values, count));
}
Code fmi2GetBoolean(Component component, const Reference references[], std::size_t count,
                    Boolean values[]) {
  return get_symbols(component, "fmi2GetBoolean", mbcosim::ValueType::boolean,
                     array(references, count), array(values, count));
}
Code fmi2GetString(Component component, const Reference references[], std::size_t count,
                   String values[]) {
  return get_symbols(component, "fmi2GetString", mbcosim::ValueType::string,
                     array(references, count), array(values, count));
}
Code fmi2SetInteger(Component component, const Reference references[], std::size_t count,
                    const Integer values[]) {
  return set_symbols(component, "fmi2SetInteger", mbcosim::ValueType::integer,
                     array(references, count), array(values, count));
}
Code fmi2SetBoolean(Component component, const Reference references[], std::size_t count,
                    const Boolean values[]) {
  return set_symbols(component, "fmi2SetBoolean", mbcosim::ValueType::boolean,
                     array(references, count), array(values, count));
}
Code fmi2SetString(Component component, const Reference references[], std::size_t count,
                   const String values[]) {
  return set_symbols(component, "fmi2SetString", mbcosim::ValueType::string,
                     array(references, count), array(values, count));
}

Code fmi2GetFMUstate(Component component, StateHandle* state) {
  return guarded(component, Call::state, "fmi2GetFMUstate",
                 [&](Instance& core) { return save_state(core, state); });
}

Code fmi2SetFMUstate(Component component, StateHandle state) {
  return guarded(component, Call::state, "fmi2SetFMUstate",
                 [&](Instance& core) { return restore_state(core, state); });
}

Code fmi2FreeFMUstate(Component component, StateHandle* state) {
  return guarded(component, Call::state, "fmi2FreeFMUstate",
                 [&](Instance&) { return free_state(state); });
}

Code fmi2SerializedFMUstateSize(Component component, StateHandle state, std::size_t* size) {
  return guarded(component, Call::state, "fmi2SerializedFMUstateSize",
                 [&](Instance& core) { return state_size(core, state, size); });
}

Code fmi2SerializeFMUstate(Component component, StateHandle state, Byte bytes[], std::size_t size) {
  return guarded(component, Call::state, "fmi2SerializeFMUstate",
                 [&](Instance& core) { return serialize_state(core, state, bytes, size); });
}

Code fmi2DeSerializeFMUstate(Component component, const Byte bytes[], std::size_t size,
                             StateHandle* state) {
  return guarded(component, Call::state, "fmi2DeSerializeFMUstate",
                 [&](Instance& core) { return deserialize_state(core, bytes, size, state); });
}

Code fmi2GetDirectionalDerivative(Component component, const Reference unknowns[],
                                  std::size_t unknown_count, const Reference knowns[],
                                  std::size_t known_count, const Real seed[], Real sensitivity[]) {
  return guarded(component, Call::derivative, "fmi2GetDirectionalDerivative", [&](Instance& core) {
    return core.derivative(array(unknowns, unknown_count), array(knowns, known_count),
                           array(seed, known_count), array(sensitivity, unknown_count), false);
  });
}

Code fmi2SetRealInputDerivatives(Component component, const Reference[], std::size_t,
                                 const Integer[], const Real[]) {
  return unsupported(component, "fmi2SetRealInputDerivatives");
}

Code fmi2GetRealOutputDerivatives(Component component, const Reference[], std::size_t,
                                  const Integer[], Real[]) {
  return unsupported(component, "fmi2GetRealOutputDerivatives");
}

Code fmi2DoStep(Component component, Real time, Real length, Boolean) {
  return guarded(component, Call::do_step, "fmi2DoStep",
                 [&](Instance& core) { return core.do_step(time, length); });
}

Code fmi2CancelStep(Component component) { return unsupported(component, "fmi2CancelStep"); }

// The kinds of status that belong to asynchronous steps are never asked for: these FMUs have none.
Code fmi2GetStatus(Component component, StatusKind, Code*) {
  return guarded(component, Call::step_status, "fmi2GetStatus", [](Instance& core) {
    return core.discard("steps are not asynchronous; the step returned its status");
  });
}

Code fmi2GetRealStatus(Component component, StatusKind kind, Real* value) {
  return guarded(component, Call::step_status, "fmi2GetRealStatus", [&](Instance& core) {
    if (kind != kLastSuccessfulTime || !value) return core.discard("no such real status");
    *value = core.last_time();
    return Status::ok;
  });
}

Code fmi2GetIntegerStatus(Component component, StatusKind, Integer*) {
  return guarded(component, Call::step_status, "fmi2GetIntegerStatus",
                 [](Instance& core) { return core.discard("no such integer status"); });
}

Code fmi2GetBooleanStatus(Component component, StatusKind kind, Boolean* value) {
  return guarded(component, Call::step_status, "fmi2GetBooleanStatus", [&](Instance& core) {
    if (kind != kTerminated || !value) return core.discard("no such boolean status");
    *value = core.ended();
    return Status::ok;
  });
}

Code fmi2GetStringStatus(Component component, StatusKind, String*) {
  return guarded(component, Call::step_status, "fmi2GetStringStatus",
                 [](Instance& core) { return core.discard("no such string status"); });
}

// ------------------------------------------------------------------ model exchange

Code fmi2EnterEventMode(Component component) {
  return unsupported(component, "fmi2EnterEventMode");
}
Code fmi2NewDiscreteStates(Component component, EventInfo*) {
  return unsupported(component, "fmi2NewDiscreteStates");
}
Code fmi2EnterContinuousTimeMode(Component component) {
  return unsupported(component, "fmi2EnterContinuousTimeMode");
}
Code fmi2CompletedIntegratorStep(Component component, Boolean, Boolean*, Boolean*) {
  return unsupported(component, "fmi2CompletedIntegratorStep");
}
Code fmi2SetTime(Component component, Real) { return unsupported(component, "fmi2SetTime"); }
Code fmi2SetContinuousStates(Component component, const Real[], std::size_t) {
  return unsupported(component, "fmi2SetContinuousStates");
}
Code fmi2GetDerivatives(Component component, Real[], std::size_t) {
  return unsupported(component, "fmi2GetDerivatives");
}
Code fmi2GetEventIndicators(Component component, Real[], std::size_t) {
  return unsupported(component, "fmi2GetEventIndicators");
}
Code fmi2GetContinuousStates(Component component, Real[], std::size_t) {
  return unsupported(component, "fmi2GetContinuousStates");
}
Code fmi2GetNominalsOfContinuousStates(Component component, Real[], std::size_t) {
  return unsupported(component, "fmi2GetNominalsOfContinuousStates");
}

}  // extern "C"
