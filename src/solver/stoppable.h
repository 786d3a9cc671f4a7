/// Analyses of a linearized system that stop when a token is cancelled: ErrorKind::cancelled soon
/// after.
#pragma once

#include "solver/cancel.h"
#include "solver/eigen_spectrum.h"
#include "solver/state_space.h"

namespace mbcosim {

/// What else is wanted of an analysis.
struct SpectrumOptions {
  bool vectors = true;  ///< of `finite_spectrum` and `eigen`; without them it is less work
  const CancelToken* cancel = nullptr;  ///< may be null
};

Result<Spectrum> finite_spectrum(const Linearization& system, const SpectrumOptions& options);
Result<Spectrum> spectrum_near(const Linearization& system, std::complex<double> shift, int count,
                               double tolerance, int basis, const SpectrumOptions& options);
Result<Spectrum> eigen(const Linearization& system, int count, std::complex<double> shift,
                       const SpectrumOptions& options);
Result<StateSpace> state_space(const Linearization& system, const InputsOutputs& io,
                               const CancelToken* cancel);

}  // namespace mbcosim
