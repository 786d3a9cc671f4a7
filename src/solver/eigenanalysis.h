/// The `eigenanalysis` card: eigenproblem of the bilinear transformation of the system about the
/// current state.
#pragma once

#include "model/diagnostic.h"
#include "model/eigen_report.h"
#include "model/model.h"
#include "solver/cancel.h"

namespace mbcosim {

/// Analyses `state`. ErrorKind::limit when the dense solver is asked for a model that is too large
/// for it. `cancel` stops the iterative solver, the dense one goes on.
Result<EigenReport> analyse_modes(const Model& model, const State& state,
                                  const EigenSettings& settings,
                                  const CancelToken* cancel = nullptr);

}  // namespace mbcosim
