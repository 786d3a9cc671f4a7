/// Input of a linear system or a sampled control.
#pragma once

#include "model/drive.h"
#include "model/node.h"

namespace mbcosim {

/// A degree of freedom or a drive.
struct ScalarValue {
  NodeDof dof;
  DrivePtr drive;  ///< null: the dof
};

}  // namespace mbcosim
