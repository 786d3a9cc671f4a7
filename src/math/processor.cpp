#include "math/processor.h"

#ifdef __x86_64__
// What the C library has asked the processor at the start. Under a hypervisor each question costs
// tens of microseconds, and `__builtin_cpu_supports` would ask them all again.
#include <sys/platform/x86.h>
#endif

namespace mbcosim {

int processor_level() {
#ifdef __x86_64__
  if (!CPU_FEATURE_ACTIVE(AVX2) || !CPU_FEATURE_ACTIVE(FMA) || !CPU_FEATURE_ACTIVE(BMI1) ||
      !CPU_FEATURE_ACTIVE(BMI2))
    return 1;
  if (!CPU_FEATURE_ACTIVE(AVX512F) || !CPU_FEATURE_ACTIVE(AVX512BW) ||
      !CPU_FEATURE_ACTIVE(AVX512CD) || !CPU_FEATURE_ACTIVE(AVX512DQ) ||
      !CPU_FEATURE_ACTIVE(AVX512VL))
    return 3;
  return 4;
#else
  return 1;
#endif
}

}  // namespace mbcosim
