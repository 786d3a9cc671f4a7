/// For processors of the level x86-64-v4; compiled so by src/CMakeLists.txt.
#define Eigen Eigen_x86_64_v4_unfused
#include "solver/panel_kernels_version.h"

namespace mbcosim {

#ifdef __AVX512F__
namespace {
constexpr PanelVersion kVersion{
    "x86-64-v4", {kernels<4>(), kernels<8>(), kernels<16>()}, 8, update};
}
const PanelVersion* const kPanelVersionV4 = &kVersion;
#else
const PanelVersion* const kPanelVersionV4 = nullptr;
#endif

}  // namespace mbcosim
