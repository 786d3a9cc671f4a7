/// What is used of LAPACK, loaded when it is needed first: linking the library and what it brings
/// along would take a good part of what every process needs to start.
#pragma once

#include <cstddef>

#include "model/diagnostic.h"

namespace mbcosim {

struct Lapack {
  using Dggevx = void(const char* balanc, const char* jobvl, const char* jobvr, const char* sense,
                      const int* n, double* a, const int* lda, double* b, const int* ldb,
                      double* alphar, double* alphai, double* beta, double* vl, const int* ldvl,
                      double* vr, const int* ldvr, int* ilo, int* ihi, double* lscale,
                      double* rscale, double* abnrm, double* bbnrm, double* rconde, double* rcondv,
                      double* work, const int* lwork, int* iwork, int* bwork, int* info,
                      std::size_t, std::size_t, std::size_t, std::size_t);
  using Dlaqps = void(const int* m, const int* n, const int* offset, const int* nb, int* kb,
                      double* a, const int* lda, int* jpvt, double* tau, double* vn1, double* vn2,
                      double* auxv, double* f, const int* ldf);
  using Dlaqp2 = void(const int* m, const int* n, const int* offset, double* a, const int* lda,
                      int* jpvt, double* tau, double* vn1, double* vn2, double* work);

  Dggevx* dggevx = nullptr;  ///< driver of the QZ iteration
  Dlaqps* dlaqps = nullptr;  ///< a panel of a QR factorization with column pivoting
  Dlaqp2* dlaqp2 = nullptr;  ///< the same, column by column

  /// Error when the library cannot be loaded; it stays the same.
  static Result<const Lapack*> get();
};

}  // namespace mbcosim
