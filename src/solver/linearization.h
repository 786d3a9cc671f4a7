/// Linearization of the descriptor system about a state: E δẏ = A δy with E = ∂F/∂ẏ, A = −∂F/∂y, F
/// = −r.
///
/// Unknowns and equations in the model's order; rotation unknowns are the increments of the last
/// step. Constraint equations enter as they are, without the step's scaling.
#pragma once

#include "model/eigen_report.h"
#include "model/model.h"

namespace mbcosim {

/// Square matrices that share the model's sparsity pattern.
struct Linearization {
  const Model* model = nullptr;
  std::vector<double> e,
      a;  ///< values in compressed columns, model.column_start and model.row_index
};

/// Drives that follow unknowns of nodes: their feedback belongs to the system, or they stay as they
/// are, which is what MBDyn's eigenanalysis takes them for.
enum class Feedback { closed, open };

Linearization linearize(const Model& model, const State& state,
                        Feedback feedback = Feedback::closed);

BilinearPencil bilinear_pencil(const Model& model, const State& state, double kappa);

}  // namespace mbcosim
