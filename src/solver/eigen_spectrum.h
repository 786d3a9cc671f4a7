/// Finite eigenvalues of the descriptor system s E v = A v.
///
/// Both ways work on T = (A − σE)⁻¹ E, whose eigenvalues are 1/(s − σ), zero for the infinite ones
/// that constraints bring.
#pragma once

#include <complex>

#include "model/diagnostic.h"
#include "solver/linearization.h"

namespace mbcosim {

/// Eigenvalues [1/s] and right eigenvectors (columns, 2-norm 1).
struct Spectrum {
  Eigen::VectorXcd values;
  Eigen::MatrixXcd vectors;
};

/// All finite eigenvalues, by dense matrices: the range of T is taken until T is regular on it.
Result<Spectrum> finite_spectrum(const Linearization& system);

/// The `count` eigenvalues nearest to `shift` [1/s], by an Arnoldi process with sparse
/// factorizations. `basis`: vectors to start with (0: chosen); the basis grows until each residual
/// is below `tolerance` relative to |1/(s − σ)|.
Result<Spectrum> spectrum_near(const Linearization& system, std::complex<double> shift, int count,
                               double tolerance = 1e-10, int basis = 0);

/// The `count` eigenvalues nearest to `shift`, nearest first, by whichever way suits the size; 0:
/// all finite ones. ErrorKind::limit when all of a model beyond the dense solver's reach are asked
/// for.
Result<Spectrum> eigen(const Linearization& system, int count, std::complex<double> shift);

}  // namespace mbcosim
