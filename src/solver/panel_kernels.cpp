#include "solver/panel_kernels.h"

#include "math/processor.h"
#include "solver/panel_kernels_version.h"

namespace mbcosim {

namespace {

// One, two and three registers of two numbers; six are the unknowns of a node.
constexpr PanelVersion kPlain{"plain", {kernels<2>(), kernels<4>(), kernels<6>()}, 2, update};

std::vector<const PanelVersion*> versions_for_this_processor() {
  std::vector<const PanelVersion*> found = {&kPlain};
  if (kPanelVersionV3 && processor_level() >= 3) found.push_back(kPanelVersionV3);
  if (kPanelVersionV4 && processor_level() >= 4) found.push_back(kPanelVersionV4);
  return found;
}

}  // namespace

const std::vector<const PanelVersion*>& panel_versions() {
  static const std::vector<const PanelVersion*> kVersions = versions_for_this_processor();
  return kVersions;
}

}  // namespace mbcosim
