#include "math/sparse_lu.h"

template class Eigen::SparseLU<Eigen::SparseMatrix<double>>;
