/// Sparse symmetric matrices in the Matrix Market exchange format, coordinate form.
#pragma once

#include <Eigen/SparseCore>
#include <string>
#include <string_view>

namespace mbcosim {

using SparseMatrix = Eigen::SparseMatrix<double>;

/// Reads `%%MatrixMarket matrix coordinate { real | integer } { symmetric | general }`; both halves
/// are stored, entries of one place are added. Throws ReductionError, with the line, when the text
/// is not a finite, square and symmetric matrix (relative asymmetry at most 1e-10) or a `symmetric`
/// one has entries in both triangles. `name` is used in messages.
SparseMatrix parse_matrix_market(const std::string& name, std::string_view text);

/// The lower half, 17 significant digits.
std::string write_matrix_market(const SparseMatrix& matrix);

}  // namespace mbcosim
