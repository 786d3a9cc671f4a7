/// Pipe without storage and inertia.
#pragma once

#include <string>

#include "elements/hydraulic/pipe_friction.h"
#include "model/fluid.h"

namespace mbcosim {

/// The flow q [kg/s] from node 1 to node 2 is the own unknown (algebraic); its equation is the
/// pressure loss
///
///   2 g(q)/(ρᵢ A) − (p₁ − p₂) = 0   [Pa]
///
/// g: PipeGeometry::friction with the reference viscosity, in the regime of q; ρᵢ: density at the
/// mean of the declared node pressures, whatever the pressures become. Source: MBDyn input manual,
/// hydraulic pipe.
struct Pipe {
  int node1, node2;
  hydraulic::PipeGeometry pipe;
  bool turbulent;
  double initial_flow;  ///< [kg/s]
  FluidPtr fluid;
  double rho;  ///< ρᵢ [kg/m³]

  static constexpr int width = 3;
  void connect(Connector& c) {
    c.scalar(node1);
    c.scalar(node2);
    c.algebraic(1);
    c.memory(1, turbulent);
  }
  void start(Start& s) const { s.own(0) = initial_flow; }

  double reynolds(const Local<double>& u) const {
    return pipe.reynolds(u.own(0), fluid->reference_viscosity());
  }

  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    const T q = u.own(0);
    const double mu = fluid->reference_viscosity();
    const bool falling = u.memory(0) != 0;
    const hydraulic::Regime regime =
        hydraulic::select_regime(pipe.reynolds(value_of(q), mu), falling);
    r.scalar(0, q);
    r.scalar(1, -q);
    r.own(0,
          2 / (rho * pipe.A) * pipe.friction(q, mu, regime, falling) - (u.scalar(0) - u.scalar(1)));
  }

  void after_convergence(const Local<double>& u, State& state) const {
    double& flag = state.memory[u.memory_offset()];
    flag = hydraulic::update_turbulent(reynolds(u), flag != 0);
  }
  void output(const Local<double>& u, OutputRow& row) const;
  std::string row_name(int) const { return "pressure loss"; }
};

}  // namespace mbcosim
