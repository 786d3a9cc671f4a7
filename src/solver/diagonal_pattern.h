/// Which numbers of the factors are not zero, found without the numbers.
#pragma once

#include <optional>
#include <vector>

#include "solver/factor_pattern.h"
#include "solver/watch.h"

namespace mbcosim {

/// Of the factors of P R⁻¹ A Q = L U with the pivots of KLU, as far as these can be told: on the
/// diagonal but in columns that no other one changes, whose numbers are those of the matrix. There
/// a diagonal that is less than `tolerance` times another one is no pivot, as those of multipliers,
/// but the largest is; the column that this was the diagonal of gets the other's row. R are the
/// largest numbers of the rows. Nothing where the diagonal of another column is missing, or where
/// the largest are alike. Pivots are those of KLU if all others are no less than `tolerance` times
/// what is below them.
///
/// A column of L has the rows that can be reached from the entries of the column of A by way of the
/// earlier columns of L; of these those suffice that come before the first row that column and row
/// of the pivot have in common (Eisenstat and Liu, "Exploiting structural symmetry in a sparse
/// partial pivoting code", SIAM J. Sci. Comput. 14(1), 1993).
///
/// `order`: P, Q and the diagonal blocks. Throws Stopped, and std::bad_alloc where places are no
/// longer of the type int.
std::optional<FactorPattern> diagonal_pattern(const std::vector<int>& column_start,
                                              const std::vector<int>& row_index,
                                              const double* values, double tolerance,
                                              BlockOrder order, const Watch& watch = Watch());

}  // namespace mbcosim
