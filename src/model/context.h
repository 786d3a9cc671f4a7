/// What an evaluation sees: the model, the state and the integrator's coefficients.
#pragma once

#include "math/types.h"
#include "model/fwd.h"

namespace mbcosim {

enum class Phase { input, assembly, derivatives, step };

/// Read-only view for residuals, drives and outputs.
struct EvalContext {
  const Model* model = nullptr;
  const State* state = nullptr;
  double time = 0;  ///< end of the step [s]
  double h = 0;     ///< step length [s]
  double c = 1;     ///< coefficient of the step: position constraint rows are divided by it
  double seed = 1;  ///< ∂y/∂δ of differential unknowns in Jacobians; c except where ∂r/∂y and ∂r/∂ẏ
                    ///< are taken apart
  double c_algebraic = 1;  ///< ∂ẏ/∂y of algebraic unknowns (bookkeeping)
  Phase phase = Phase::step;
  bool follows = false;        ///< matrices know what drives follow at once: Newton's in steps do
  Scratch* scratch = nullptr;  ///< of elements; null where results are read
  Vec3 uniform_gravity = Vec3::Zero();  ///< [m/s²]; see Model::gravity_at for any point
};

/// Position, orientation and velocities of a structural node, global components.
struct NodeState {
  Vec3 x = Vec3::Zero();      ///< [m]
  Mat3 R = Mat3::Identity();  ///< node frame -> global
  Vec3 v = Vec3::Zero();      ///< [m/s]
  Vec3 w = Vec3::Zero();      ///< [rad/s]
};

struct NodeAcceleration {
  Vec3 a = Vec3::Zero();   ///< linear, global [m/s²]
  Vec3 wp = Vec3::Zero();  ///< angular, global [rad/s²]
};

}  // namespace mbcosim
