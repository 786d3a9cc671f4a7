/// Sparse LU whose last columns are nearly full, as those of a body with many modes: a sparse head,
/// a dense tail.
///
///   P R⁻¹ A Q = [ L11    ] [ U11 U12 ]     T = A22 − L21 U12,  dense, with pivoting
///               [ L21  1 ] [      T  ]
///
/// P, Q and the pattern come from a factorization by KLU of a reference matrix; R scales the rows
/// by their largest entries. The tail has the largest k for which the last k columns of L are
/// nearly full. Results depend on the matrix and on the reference only.
#pragma once

#include <Eigen/Dense>
#include <memory>
#include <vector>

#include "math/decompositions.h"
#include "math/types.h"
#include "solver/watch.h"

namespace mbcosim {

struct KluReference;  // in dense_tail.cpp

class DenseTail {
 public:
  /// Null when the reference matrix has no dense tail worth the trouble. rows, columns: order of
  /// elimination (n); null: AMD of A + Aᵀ. Throws Stopped.
  static std::unique_ptr<DenseTail> plan(int n, int* column_start, int* row_index, double* values,
                                         int* rows = nullptr, int* columns = nullptr,
                                         const Watch& watch = Watch());

  /// False when pivots of the head are poor against those of the reference matrix. Throws Stopped.
  bool factor(const double* values, const Watch& watch = Watch());
  void solve(double* rhs);
  int size() const { return n_ - head_; }  ///< k
  std::size_t bytes() const;               ///< of memory, all but some for each column

 private:
  struct Columns {
    std::vector<int> start, row;
    std::vector<double> value;
    /// Keeps the entries of the first `columns` columns for which keep(row, column).
    template <class Keep>
    void filter(int columns, Keep keep);
  };
  DenseTail(int n, const int* column_start, const int* row_index);
  bool read_factors(KluReference& reference);
  bool choose_head(double flops);
  bool scale_rows(const double* values);
  void eliminate(const double* values, int j);
  bool read_head_column(int j);
  bool factor_columns(const double* values, const Watch& watch);

  int n_, head_ = 0;
  std::vector<int> column_start_, row_index_;
  std::vector<int> column_;        ///< Q: of the matrix, by elimination order (n)
  std::vector<int> order_of_row_;  ///< P⁻¹ (n)
  Columns lower_;                  ///< L11 and L21 by columns, without the ones (head)
  Columns upper_;  ///< U11 and U12 by columns, rows ascending, without the diagonal (n)
  std::vector<double> pivots_;         ///< (head)
  std::vector<double> scale_;          ///< R⁻¹ by matrix row (n)
  std::vector<double> work_;           ///< (n)
  double smallest_ = 0, largest_ = 0;  ///< pivots of the head
  double reference_ratio_ = 0;         ///< of the two, for the reference matrix
  MatX tail_;                          ///< T (k, k)
  VecX tail_rhs_, tail_solution_;      ///< (k)
  Eigen::PartialPivLU<MatX> tail_factor_;
};

}  // namespace mbcosim
