/// The assembled system F(y, ẏ, t) = 0: residual, Jacobian, and the update of states by a Newton
/// correction.
#pragma once

#include "model/model.h"
#include "solver/workspace.h"

namespace mbcosim {

/// r = −F at the state in `context` (n); by the caller alone when `evaluators` is null.
void compute_residual(EvalContext context, Scratch& scratch, std::vector<double>& r,
                      Evaluators* evaluators = nullptr);

/// J = −∂r/∂δ into workspace.values; also computes the node seeds.
void compute_jacobian(EvalContext context, Workspace& workspace);

/// How node rotations depend on the Newton increments: A = c G(g), B = ∂w/∂δ.
NodeSeeds node_seeds(const Vec3& g, const Vec3& gp, const Vec3& w_ref, double c);

/// The seeds of all structural nodes at the state in `context`.
void compute_seeds(const EvalContext& context, std::vector<NodeSeeds>& seeds,
                   ThreadTeam* team = nullptr);

/// Refreshes R and w of every node from g, ġ and the references.
void update_rotations(const Model& model, State& state, ThreadTeam* team = nullptr);

/// Adds δ: differential ẏ += δ, y += c δ; algebraic y += δ, ẏ += c_a δ; then the rotations.
void apply_correction(const Model& model, const std::vector<double>& delta, double c,
                      double c_algebraic, State& state, ThreadTeam* team = nullptr);

/// Evaluates the drives of `driven` elements at a prediction; those that were not active at the one
/// before get their start values. What their hints give is taken then and, without `restart`, from
/// all that are active.
void update_activity(const EvalContext& context, State& state, bool restart);
/// Evaluates them at another iterate of the step: as in MBDyn elements are switched at once, and
/// start anew only at the next prediction. Was one switched?
bool follow_activity(const EvalContext& context, State& state);

}  // namespace mbcosim
