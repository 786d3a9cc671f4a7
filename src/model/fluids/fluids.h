/// The fluid types of the language. Source: MBDyn input manual, hydraulic fluid, and the behaviour
/// of MBDyn 1.7.3.
#pragma once

#include "model/fluid.h"

namespace mbcosim {

/// ρ = ρ₀.
class IncompressibleFluid final : public Fluid {
 public:
  using Fluid::Fluid;
  Density density_at(double p) const override;
};

/// ρ = ρ₀ (1 + (p − p_ref)/β). No cut-off: ρ is negative for p < p_ref − β. Serves `linear thermal
/// compressible` too, since no element has a temperature.
class LinearCompressibleFluid final : public Fluid {
 public:
  LinearCompressibleFluid(double rho0, double mu, double bulk_modulus, double reference_pressure)
      : Fluid(rho0, mu), slope_(rho0 / bulk_modulus), p_ref_(reference_pressure) {}
  Density density_at(double p) const override;

 private:
  double slope_;  ///< ρ₀/β [kg/(m³·Pa)]
  double p_ref_;  ///< [Pa]
};

/// Liquid that turns into vapour around p_c = 20265 Pa:
///
///   ρ = r₀ + ρ₀/2 (1 + tanh(a (p − p_c))) + [p > p_c] (p − p_c) ρ₀/β
///   r₀ = 9.77 kg/m³,  a = 2·10⁻⁵ 1/Pa
///
/// μ below p_c is 10⁻⁶ of its value above. The constants are fixed and the reference pressure has
/// no effect, so ρ(p_ref) is not ρ₀.
class SuperFluid final : public Fluid {
 public:
  SuperFluid(double rho0, double mu, double bulk_modulus)
      : Fluid(rho0, mu), slope_(rho0 / bulk_modulus) {}
  Density density_at(double p) const override;
  double viscosity(double p) const override;

 private:
  double slope_;  ///< ρ₀/β [kg/(m³·Pa)]
};

/// ρ = ρ₀ exp(k (p − p_ref)/β) with k = 1 from the saturation pressure up and 1000 below, where μ =
/// 0. ρ jumps at p_sat.
class ExponentialFluid final : public Fluid {
 public:
  ExponentialFluid(double rho0, double mu, double bulk_modulus, double reference_pressure,
                   double saturation_pressure)
      : Fluid(rho0, mu),
        beta_(bulk_modulus),
        p_ref_(reference_pressure),
        p_sat_(saturation_pressure) {}
  Density density_at(double p) const override;
  double viscosity(double p) const override;

 private:
  double beta_, p_ref_, p_sat_;  ///< [Pa]
};

}  // namespace mbcosim
