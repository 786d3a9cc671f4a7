/// Readers of fluids. The properties have keywords, but their order is fixed.
#include <cstdio>
#include <limits>
#include <memory>
#include <string>

#include "model/card.h"
#include "model/fluids/fluids.h"
#include "model/registry.h"

namespace mbcosim {
namespace {

double read_positive(Card& card, const std::string& what) {
  const double value = card.real(what);
  if (value > std::numeric_limits<double>::epsilon()) return value;
  char text[32];
  std::snprintf(text, sizeof text, "%g", value);
  card.fail(what + " must be positive, got " + text);
}

double read_property(Card& card, std::string_view keyword, const std::string& what) {
  card.required("fluid property", {keyword});
  return read_positive(card, what);
}

/// `{ sound celerity, <c> | <beta> }`; β = c² ρ₀.
double read_bulk_modulus(Card& card, double rho0) {
  if (!card.keyword("sound celerity")) return read_positive(card, "bulk modulus");
  const double c = read_positive(card, "sound celerity");
  return c * c * rho0;
}

double read_reference(Card& card, const std::string& what) {
  const double value = card.real(what);
  if (value < 0) card.warn(what + " is negative");
  return value;
}

void read_unused_temperature(Card& card) {
  if (card.keyword("temperature")) read_reference(card, "fluid temperature");
}

FluidPtr read_incompressible(Card& card) {
  const double rho0 = read_property(card, "density", "fluid density");
  const double mu = read_property(card, "viscosity", "fluid viscosity");
  if (card.keyword("pressure")) read_reference(card, "reference pressure");
  read_unused_temperature(card);
  return std::make_shared<IncompressibleFluid>(rho0, mu);
}

/// What the compressible types have in common.
struct Compressible {
  double rho0 = 0, beta = 0, p_ref = 0;
};

Compressible read_compressible(Card& card) {
  Compressible c;
  c.rho0 = read_property(card, "density", "fluid density");
  c.beta = read_bulk_modulus(card, c.rho0);
  c.p_ref = read_reference(card, "reference pressure");
  return c;
}

FluidPtr read_linear_compressible(Card& card) {
  const Compressible c = read_compressible(card);
  const double mu = read_property(card, "viscosity", "fluid viscosity");
  read_unused_temperature(card);
  return std::make_shared<LinearCompressibleFluid>(c.rho0, mu, c.beta, c.p_ref);
}

FluidPtr read_linear_thermal_compressible(Card& card) {
  const Compressible c = read_compressible(card);
  card.real("thermal expansion coefficient");
  read_reference(card, "reference temperature");
  const double mu = read_property(card, "viscosity", "fluid viscosity");
  return std::make_shared<LinearCompressibleFluid>(c.rho0, mu, c.beta, c.p_ref);
}

FluidPtr read_super(Card& card) {
  const Compressible c = read_compressible(card);
  const double mu = read_property(card, "viscosity", "fluid viscosity");
  read_unused_temperature(card);
  return std::make_shared<SuperFluid>(c.rho0, mu, c.beta);
}

FluidPtr read_exponential_fluid(Card& card) {
  const Compressible c = read_compressible(card);
  const double mu = read_property(card, "viscosity", "fluid viscosity");
  read_unused_temperature(card);
  const double p_sat = card.real("saturation pressure");
  return std::make_shared<ExponentialFluid>(c.rho0, mu, c.beta, c.p_ref, p_sat);
}

}  // namespace

void register_fluids(Registry& registry) {
  registry.fluid({"incompressible", "uncompressible"}, read_incompressible);
  registry.fluid({"linear compressible"}, read_linear_compressible);
  registry.fluid({"linear thermal compressible"}, read_linear_thermal_compressible);
  registry.fluid({"super"}, read_super);
  registry.fluid({"exponential"}, read_exponential_fluid);
}

}  // namespace mbcosim
