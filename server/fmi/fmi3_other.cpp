/// Functions of FMI 3.0 that a co-simulation FMU must have although its modelDescription.xml rules
/// them out: types that no variable has, clocks, events, the other interface types.
#include "fmi/fmi3_types.h"
#include "fmi/guard.h"

using namespace mbcosim::fmi;
using namespace mbcosim::fmi3;

namespace {

Code get_none(Handle instance, const char* function, const char* type, std::size_t count) {
  return no_such_type(instance, Call::get, function, type, count);
}
Code set_none(Handle instance, const char* function, const char* type, std::size_t count) {
  return no_such_type(instance, Call::set, function, type, count);
}

}  // namespace

extern "C" {

Code fmi3GetFloat32(Handle instance, const Reference[], std::size_t count, Float32[], std::size_t) {
  return get_none(instance, "fmi3GetFloat32", "Float32", count);
}
Code fmi3SetFloat32(Handle instance, const Reference[], std::size_t count, const Float32[],
                    std::size_t) {
  return set_none(instance, "fmi3SetFloat32", "Float32", count);
}
Code fmi3GetInt8(Handle instance, const Reference[], std::size_t count, std::int8_t[],
                 std::size_t) {
  return get_none(instance, "fmi3GetInt8", "Int8", count);
}
Code fmi3SetInt8(Handle instance, const Reference[], std::size_t count, const std::int8_t[],
                 std::size_t) {
  return set_none(instance, "fmi3SetInt8", "Int8", count);
}
Code fmi3GetUInt8(Handle instance, const Reference[], std::size_t count, std::uint8_t[],
                  std::size_t) {
  return get_none(instance, "fmi3GetUInt8", "UInt8", count);
}
Code fmi3SetUInt8(Handle instance, const Reference[], std::size_t count, const std::uint8_t[],
                  std::size_t) {
  return set_none(instance, "fmi3SetUInt8", "UInt8", count);
}
Code fmi3GetInt16(Handle instance, const Reference[], std::size_t count, std::int16_t[],
                  std::size_t) {
  return get_none(instance, "fmi3GetInt16", "Int16", count);
}
Code fmi3SetInt16(Handle instance, const Reference[], std::size_t count, const std::int16_t[],
                  std::size_t) {
  return set_none(instance, "fmi3SetInt16", "Int16", count);
}
Code fmi3GetUInt16(Handle instance, const Reference[], std::size_t count, std::uint16_t[],
                   std::size_t) {
  return get_none(instance, "fmi3GetUInt16", "UInt16", count);
}
Code fmi3SetUInt16(Handle instance, const Reference[], std::size_t count, const std::uint16_t[],
                   std::size_t) {
  return set_none(instance, "fmi3SetUInt16", "UInt16", count);
}
Code fmi3GetUInt32(Handle instance, const Reference[], std::size_t count, std::uint32_t[],
                   std::size_t) {
  return get_none(instance, "fmi3GetUInt32", "UInt32", count);
}
Code fmi3SetUInt32(Handle instance, const Reference[], std::size_t count, const std::uint32_t[],
                   std::size_t) {
  return set_none(instance, "fmi3SetUInt32", "UInt32", count);
}
Code fmi3GetInt64(Handle instance, const Reference[], std::size_t count, std::int64_t[],
                  std::size_t) {
  return get_none(instance, "fmi3GetInt64", "Int64", count);
}
Code fmi3SetInt64(Handle instance, const Reference[], std::size_t count, const std::int64_t[],
                  std::size_t) {
  return set_none(instance, "fmi3SetInt64", "Int64", count);
}
Code fmi3GetUInt64(Handle instance, const Reference[], std::size_t count, std::uint64_t[],
                   std::size_t) {
  return get_none(instance, "fmi3GetUInt64", "UInt64", count);
}
Code fmi3SetUInt64(Handle instance, const Reference[], std::size_t count, const std::uint64_t[],
                   std::size_t) {
  return set_none(instance, "fmi3SetUInt64", "UInt64", count);
}
Code fmi3GetBinary(Handle instance, const Reference[], std::size_t count, std::size_t[], Binary[],
                   std::size_t) {
  return get_none(instance, "fmi3GetBinary", "Binary", count);
}
Code fmi3SetBinary(Handle instance, const Reference[], std::size_t count, const std::size_t[],
                   const Binary[], std::size_t) {
  return set_none(instance, "fmi3SetBinary", "Binary", count);
}
Code fmi3GetClock(Handle instance, const Reference[], std::size_t count, Clock[]) {
  return get_none(instance, "fmi3GetClock", "Clock", count);
}
Code fmi3SetClock(Handle instance, const Reference[], std::size_t count, const Clock[]) {
  return set_none(instance, "fmi3SetClock", "Clock", count);
}

Code fmi3GetNumberOfVariableDependencies(Handle instance, Reference, std::size_t*) {
  return unsupported(instance, "fmi3GetNumberOfVariableDependencies");
}
Code fmi3GetVariableDependencies(Handle instance, Reference, std::size_t[], Reference[],
                                 std::size_t[], DependencyKind[], std::size_t) {
  return unsupported(instance, "fmi3GetVariableDependencies");
}
Code fmi3EnterConfigurationMode(Handle instance) {
  return unsupported(instance, "fmi3EnterConfigurationMode");
}
Code fmi3ExitConfigurationMode(Handle instance) {
  return unsupported(instance, "fmi3ExitConfigurationMode");
}
Code fmi3EnterEventMode(Handle instance) { return unsupported(instance, "fmi3EnterEventMode"); }
Code fmi3GetIntervalDecimal(Handle instance, const Reference[], std::size_t, Float64[],
                            IntervalQualifier[]) {
  return unsupported(instance, "fmi3GetIntervalDecimal");
}
Code fmi3GetIntervalFraction(Handle instance, const Reference[], std::size_t, std::uint64_t[],
                             std::uint64_t[], IntervalQualifier[]) {
  return unsupported(instance, "fmi3GetIntervalFraction");
}
Code fmi3GetShiftDecimal(Handle instance, const Reference[], std::size_t, Float64[]) {
  return unsupported(instance, "fmi3GetShiftDecimal");
}
Code fmi3GetShiftFraction(Handle instance, const Reference[], std::size_t, std::uint64_t[],
                          std::uint64_t[]) {
  return unsupported(instance, "fmi3GetShiftFraction");
}
Code fmi3SetIntervalDecimal(Handle instance, const Reference[], std::size_t, const Float64[]) {
  return unsupported(instance, "fmi3SetIntervalDecimal");
}
Code fmi3SetIntervalFraction(Handle instance, const Reference[], std::size_t, const std::uint64_t[],
                             const std::uint64_t[]) {
  return unsupported(instance, "fmi3SetIntervalFraction");
}
Code fmi3SetShiftDecimal(Handle instance, const Reference[], std::size_t, const Float64[]) {
  return unsupported(instance, "fmi3SetShiftDecimal");
}
Code fmi3SetShiftFraction(Handle instance, const Reference[], std::size_t, const std::uint64_t[],
                          const std::uint64_t[]) {
  return unsupported(instance, "fmi3SetShiftFraction");
}
Code fmi3EvaluateDiscreteStates(Handle instance) {
  return unsupported(instance, "fmi3EvaluateDiscreteStates");
}
Code fmi3UpdateDiscreteStates(Handle instance, Boolean*, Boolean*, Boolean*, Boolean*, Boolean*,
                              Float64*) {
  return unsupported(instance, "fmi3UpdateDiscreteStates");
}
Code fmi3EnterContinuousTimeMode(Handle instance) {
  return unsupported(instance, "fmi3EnterContinuousTimeMode");
}
Code fmi3CompletedIntegratorStep(Handle instance, Boolean, Boolean*, Boolean*) {
  return unsupported(instance, "fmi3CompletedIntegratorStep");
}
Code fmi3SetTime(Handle instance, Float64) { return unsupported(instance, "fmi3SetTime"); }
Code fmi3SetContinuousStates(Handle instance, const Float64[], std::size_t) {
  return unsupported(instance, "fmi3SetContinuousStates");
}
Code fmi3GetContinuousStateDerivatives(Handle instance, Float64[], std::size_t) {
  return unsupported(instance, "fmi3GetContinuousStateDerivatives");
}
Code fmi3GetEventIndicators(Handle instance, Float64[], std::size_t) {
  return unsupported(instance, "fmi3GetEventIndicators");
}
Code fmi3GetContinuousStates(Handle instance, Float64[], std::size_t) {
  return unsupported(instance, "fmi3GetContinuousStates");
}
Code fmi3GetNominalsOfContinuousStates(Handle instance, Float64[], std::size_t) {
  return unsupported(instance, "fmi3GetNominalsOfContinuousStates");
}
Code fmi3GetNumberOfEventIndicators(Handle instance, std::size_t*) {
  return unsupported(instance, "fmi3GetNumberOfEventIndicators");
}
Code fmi3GetNumberOfContinuousStates(Handle instance, std::size_t*) {
  return unsupported(instance, "fmi3GetNumberOfContinuousStates");
}
Code fmi3EnterStepMode(Handle instance) { return unsupported(instance, "fmi3EnterStepMode"); }
Code fmi3GetOutputDerivatives(Handle instance, const Reference[], std::size_t, const std::int32_t[],
                              Float64[], std::size_t) {
  return unsupported(instance, "fmi3GetOutputDerivatives");
}
Code fmi3ActivateModelPartition(Handle instance, Reference, Float64) {
  return unsupported(instance, "fmi3ActivateModelPartition");
}

}  // extern "C"
