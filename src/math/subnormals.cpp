#include "math/subnormals.h"

#if defined(__SSE2__)
#include <immintrin.h>
#endif

namespace mbcosim {

#if defined(__SSE2__)

namespace {

constexpr unsigned kModes = _MM_FLUSH_ZERO_MASK | _MM_DENORMALS_ZERO_MASK;  ///< results, operands

}  // namespace

unsigned subnormal_mode() { return _mm_getcsr() & kModes; }

void set_subnormal_mode(unsigned mode) { _mm_setcsr((_mm_getcsr() & ~kModes) | mode); }

SubnormalsAreZero::SubnormalsAreZero() { set_subnormal_mode(kModes); }

#else

unsigned subnormal_mode() { return 0; }

void set_subnormal_mode(unsigned) {}

SubnormalsAreZero::SubnormalsAreZero() = default;

#endif

}  // namespace mbcosim
