/// For processors of the level x86-64-v3; compiled so by src/CMakeLists.txt.
#define Eigen Eigen_x86_64_v3_unfused
#include "solver/panel_kernels_version.h"

namespace mbcosim {

#ifdef __AVX2__
namespace {
constexpr PanelVersion kVersion{"x86-64-v3", {kernels<2>(), kernels<4>(), kernels<8>()}, 4, update};
}
const PanelVersion* const kPanelVersionV3 = &kVersion;
#else
const PanelVersion* const kPanelVersionV3 = nullptr;
#endif

}  // namespace mbcosim
