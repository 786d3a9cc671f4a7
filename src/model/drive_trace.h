#pragma once

#include <vector>

#include "model/fwd.h"

namespace mbcosim {

/// Drives with `output trace`, by label: a ModelPart. Their lines stand in .trc for every step.
struct DriveTraces {
  struct Trace {
    int label;
    DrivePtr drive;
    bool value, derivative;  ///< what is written
  };
  std::vector<Trace> traces;
};

}  // namespace mbcosim
