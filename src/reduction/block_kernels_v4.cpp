/// For processors of the level x86-64-v4; compiled so by src/CMakeLists.txt.
#define Eigen Eigen_x86_64_v4
#include "reduction/block_kernels_version.h"

namespace mbcosim {

#ifdef __AVX512F__
namespace {
constexpr BlockKernels kKernels = kernels("x86-64-v4");
}
const BlockKernels* const kKernelsV4 = &kKernels;
#else
const BlockKernels* const kKernelsV4 = nullptr;
#endif

}  // namespace mbcosim
