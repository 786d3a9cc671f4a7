#include "reduction/block_kernels.h"

#include "math/processor.h"

namespace mbcosim {

namespace {

std::vector<const BlockKernels*> versions_for_this_processor() {
  std::vector<const BlockKernels*> found = {kPlainKernels};
  if (kKernelsV3 && processor_level() >= 3) found.push_back(kKernelsV3);
  if (kKernelsV4 && processor_level() >= 4) found.push_back(kKernelsV4);
  return found;
}

}  // namespace

const std::vector<const BlockKernels*>& block_kernels() {
  static const std::vector<const BlockKernels*> kVersions = versions_for_this_processor();
  return kVersions;
}

const BlockKernels* find_block_kernels(const std::string& processor) {
  if (processor == "auto") return block_kernels().back();
  for (const BlockKernels* kernels : block_kernels())
    if (processor == kernels->processor) return kernels;
  return nullptr;
}

}  // namespace mbcosim
