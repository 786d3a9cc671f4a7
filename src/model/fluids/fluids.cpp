#include "model/fluids/fluids.h"

#include <cmath>

namespace mbcosim {
namespace {

constexpr double kVapourPressure = 20265;   // p_c of SuperFluid [Pa]
constexpr double kVapourDensity = 9.77;     // r₀ [kg/m³]
constexpr double kTransitionSlope = 2e-5;   // a [1/Pa]
constexpr double kVapourViscosity = 1e-6;   // μ(vapour)/μ(liquid)
constexpr double kVapourCompliance = 1000;  // k of ExponentialFluid below p_sat

}  // namespace

Fluid::Density IncompressibleFluid::density_at(double) const { return {reference_density(), 0, 0}; }

Fluid::Density LinearCompressibleFluid::density_at(double p) const {
  return {reference_density() + (p - p_ref_) * slope_, slope_, 0};
}

Fluid::Density SuperFluid::density_at(double p) const {
  const double dp = p - kVapourPressure;
  const double t = std::tanh(kTransitionSlope * dp);
  const double half = 0.5 * reference_density();
  const double sech2 = 1 - t * t;
  Density d;
  d.rho = kVapourDensity + half * (1 + t);
  d.slope = kTransitionSlope * half * sech2;
  d.curvature = -2 * kTransitionSlope * t * d.slope;
  if (dp > 0) {
    d.rho += dp * slope_;
    d.slope += slope_;
  }
  return d;
}

double SuperFluid::viscosity(double p) const {
  return p >= kVapourPressure ? reference_viscosity() : kVapourViscosity * reference_viscosity();
}

Fluid::Density ExponentialFluid::density_at(double p) const {
  const double k = (p >= p_sat_ ? 1 : kVapourCompliance) / beta_;
  const double rho = reference_density() * std::exp(k * (p - p_ref_));
  return {rho, k * rho, k * k * rho};
}

double ExponentialFluid::viscosity(double p) const {
  return p >= p_sat_ ? reference_viscosity() : 0;
}

}  // namespace mbcosim
