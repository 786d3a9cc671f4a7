#include "reduction/block_kernels.h"

namespace mbcosim {

namespace {

#ifdef __x86_64__
/// By what tells the levels apart on the processors that there are.
bool has_level_3() {
  return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") &&
         __builtin_cpu_supports("bmi") && __builtin_cpu_supports("bmi2");
}
bool has_level_4() {
  return has_level_3() && __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
         __builtin_cpu_supports("avx512cd") && __builtin_cpu_supports("avx512dq") &&
         __builtin_cpu_supports("avx512vl");
}
#endif

std::vector<const BlockKernels*> versions_for_this_processor() {
  std::vector<const BlockKernels*> found = {kPlainKernels};
#ifdef __x86_64__
  if (kKernelsV3 && has_level_3()) found.push_back(kKernelsV3);
  if (kKernelsV4 && has_level_4()) found.push_back(kKernelsV4);
#endif
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
