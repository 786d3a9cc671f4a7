/// Scratch of elements during an evaluation: belongs to one thread, never saved; results never
/// depend on what it held before.
#pragma once

#include <vector>

#include "model/evaluation_watch.h"

namespace mbcosim {

/// How much the elements of a model need, known when it is built.
struct ScratchSizes {
  int local = 0;  ///< of the element that needs most
  int sums = 0;   ///< of all elements
};

struct Scratch {
  explicit Scratch(const ScratchSizes& sizes) : local(sizes.local), sums(sizes.sums) {}

  std::vector<double> local;  ///< of the element being evaluated: it finds there what others left
  /// What elements sum over others (`accumulate`): zero before each evaluation, then filled in the
  /// order of families, then read. `Connection::sums` tells each element its part.
  std::vector<double> sums;
  Interruption interruption;  ///< of the evaluations with it
};

}  // namespace mbcosim
