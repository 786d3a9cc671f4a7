/// Hydraulic fluids: density and viscosity as functions of the pressure.
#pragma once

#include "math/dual.h"
#include "model/fwd.h"

namespace mbcosim {

/// Immutable, without memory: elements share it. Pressures are plain numbers, without a gauge or
/// absolute convention.
class Fluid {
 public:
  /// ρ(p) with its first two derivatives.
  struct Density {
    double rho = 0;        ///< ρ [kg/m³]
    double slope = 0;      ///< dρ/dp [kg/(m³·Pa)]
    double curvature = 0;  ///< d²ρ/dp² [kg/(m³·Pa²)]
  };

  Fluid(double reference_density, double reference_viscosity)
      : rho0_(reference_density), mu0_(reference_viscosity) {}
  virtual ~Fluid() = default;

  virtual Density density_at(double p) const = 0;
  /// Dynamic viscosity μ(p), constant by pieces [Pa·s].
  virtual double viscosity(double p) const { return (void)p, mu0_; }

  double reference_density() const { return rho0_; }   ///< ρ₀ as written in the deck [kg/m³]
  double reference_viscosity() const { return mu0_; }  ///< μ as written in the deck [Pa·s]

  double density(double p) const { return density_at(p).rho; }
  template <int N>
  Dual<N> density(const Dual<N>& p) const {
    const Density d = density_at(p.v);
    return p.chain(d.rho, d.slope);
  }
  double density_slope(double p) const { return density_at(p).slope; }
  template <int N>
  Dual<N> density_slope(const Dual<N>& p) const {
    const Density d = density_at(p.v);
    return p.chain(d.slope, d.curvature);
  }

 private:
  double rho0_, mu0_;
};

}  // namespace mbcosim
