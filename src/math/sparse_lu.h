/// Eigen's sparse LU, compiled once: it takes the compiler seconds wherever it is instantiated.
#pragma once

#include <Eigen/SparseLU>

extern template class Eigen::SparseLU<Eigen::SparseMatrix<double>>;
