/// Inertia of a finite element model: lumped at its nodes, and as one rigid body.
#pragma once

#include "elements/modal/fem_data.h"
#include "reduction/fe_model.h"

namespace mbcosim {

/// True when the mass matrix is diagonal and equal in the three directions of each node.
bool is_lumped(const FeModel& model);

/// Diagonal mass matrix after Hinton, Rock and Zienkiewicz: the diagonal of M, scaled so that the
/// whole body keeps its mass in each direction; then the mean of the directions at each node.
SparseMatrix lumped_mass(const FeModel& model);

/// Group 11 of all nodes: mx my mz Jx Jy Jz (6 × nodes) of a diagonal mass matrix.
MatX nodal_inertia(const FeModel& model, const SparseMatrix& diagonal);

/// Mass, centre of mass in the model's frame, inertia about it. `warning` is set when the mass
/// differs by direction.
FemRigidInertia rigid_inertia(const FeModel& model, std::string& warning);

}  // namespace mbcosim
