/// The stages of a step around residual and matrix, in which elements of different families meet.
///
///   after the prediction   once a step: what follows from the predicted state (a shell's average
///                          frame), into State::memory
///   accumulation           before each residual and each matrix, those of the initial assembly
///                          too: contributions to what elements sum over others (a rotor over
///                          its blades), into Scratch::sums
///   residual, matrix       all elements, in tiles; sums are read
///   after convergence      once a step: what the accepted state leaves behind, into State::memory
///
/// Within a stage elements come in the order of Model::stage_order: by the rank of their family,
/// then by set. Residual and matrix do not depend on an order. A team shares elements whose stages
/// keep apart (ElementSet::stages_apart).
#pragma once

#include "math/thread_team.h"
#include "model/context.h"
#include "model/scratch.h"

namespace mbcosim {

void run_after_prediction(EvalContext context, Scratch& scratch, State& state,
                          ThreadTeam* team = nullptr);
/// Fills the sums in the scratch of the context; nothing to do for a model without.
void accumulate(const EvalContext& context);
void run_after_convergence(EvalContext context, Scratch& scratch, State& state,
                           ThreadTeam* team = nullptr);

}  // namespace mbcosim
