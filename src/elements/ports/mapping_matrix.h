/// The matrix by which points or modes of an external code follow the nodes of a model.
#pragma once

#include <Eigen/SparseCore>

namespace mbcosim {

/// Each row has a few neighbours of its point: full matrices of large interfaces would not fit in
/// memory (3000 by 3000 points: 650 MB).
using MappingMatrix = Eigen::SparseMatrix<double, Eigen::RowMajor>;

}  // namespace mbcosim
