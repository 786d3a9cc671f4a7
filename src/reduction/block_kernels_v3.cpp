/// For processors of the level x86-64-v3; compiled so by src/CMakeLists.txt.
#define Eigen Eigen_x86_64_v3
#include "reduction/block_kernels_version.h"

namespace mbcosim {

#ifdef __AVX2__
namespace {
constexpr BlockKernels kKernels = kernels("x86-64-v3");
}
const BlockKernels* const kKernelsV3 = &kKernels;
#else
const BlockKernels* const kKernelsV3 = nullptr;
#endif

}  // namespace mbcosim
