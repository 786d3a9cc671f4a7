/// For every processor: Eigen as in the rest of the program.
#include "reduction/block_kernels_version.h"

namespace mbcosim {

namespace {
constexpr BlockKernels kKernels = kernels("plain");
}

const BlockKernels* const kPlainKernels = &kKernels;

}  // namespace mbcosim
