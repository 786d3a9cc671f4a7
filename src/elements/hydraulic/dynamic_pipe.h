/// Pipe with inertia and compressibility of the fluid.
#pragma once

#include <string>

#include "elements/hydraulic/pipe_friction.h"
#include "model/fluid.h"

namespace mbcosim {

/// One finite volume with linear pressure and flow along the pipe; all four own unknowns are
/// differential:
///
///   P₁, P₂ [Pa]    pressures of the ends (copies of the node pressures)
///   q₁, q₂ [kg/s]  flows at the ends, positive from node 1 to node 2
///
/// With P₀ = (P₁+P₂)/2, q_m = (q₁+q₂)/2, ρᵢ = ρ(Pᵢ), b₁ = ρ′(¾P₁+¼P₂), b₂ = ρ′(¼P₁+¾P₂):
///
///   node 1     q_m + (A L/8) b₁ (3 Ṗ₁ + Ṗ₂)           flow out of the node
///   node 2    −q_m + (A L/8) b₂ (Ṗ₁ + 3 Ṗ₂)
///   1st half  (L/8)(3q̇₁ + q̇₂) + q_m²/(ρ₀A) − q₁²/(ρ₁A) + (A/2)(P₂−P₁) + g(¾q₁+¼q₂)/½(ρ₁+ρ₀) = 0
///   2nd half  (L/8)(q̇₁ + 3q̇₂) + q₂²/(ρ₂A) − q_m²/(ρ₀A) + (A/2)(P₂−P₁) + g(¼q₁+¾q₂)/½(ρ₀+ρ₂) = 0
///   ends      p₁ − P₁ = 0,  p₂ − P₂ = 0                (halves: [N])
///
/// g: PipeGeometry::friction in the regime of q_m. N.B.: an initial flow q₀ means q₁ = q₀ and q₂ =
/// −q₀, as MBDyn has it. Source: MBDyn input manual, hydraulic dynamic pipe.
struct DynamicPipe {
  int node1, node2;
  hydraulic::PipeGeometry pipe;
  bool turbulent;
  double initial_flow;  ///< [kg/s]
  FluidPtr fluid;

  static constexpr int width = 6;
  void connect(Connector& c) {
    c.scalar(node1);
    c.scalar(node2);
    c.differential(4);
    c.memory(1, turbulent);
  }
  void start(Start& s) const {
    s.own(0) = hydraulic::declared_pressure(s.u, 0);
    s.own(1) = hydraulic::declared_pressure(s.u, 1);
    s.own(2) = initial_flow;
    s.own(3) = -initial_flow;
  }

  /// Reynolds number of the mean flow.
  double reynolds(const Local<double>& u) const {
    return pipe.reynolds(0.5 * (u.own(2) + u.own(3)),
                         fluid->viscosity(0.5 * (u.own(0) + u.own(1))));
  }

  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    const double A = pipe.A, L = pipe.L;
    const T P1 = u.own(0), P2 = u.own(1), q1 = u.own(2), q2 = u.own(3);
    const T P0 = 0.5 * (P1 + P2), qm = 0.5 * (q1 + q2);
    const T rho1 = fluid->density(P1), rho2 = fluid->density(P2), rho0 = fluid->density(P0);
    const T b1 = fluid->density_slope(T(0.75 * P1 + 0.25 * P2)),
            b2 = fluid->density_slope(T(0.25 * P1 + 0.75 * P2));
    r.scalar(0, qm + A * L / 8 * b1 * (3.0 * u.own_rate(0) + u.own_rate(1)));
    r.scalar(1, -qm + A * L / 8 * b2 * (u.own_rate(0) + 3.0 * u.own_rate(1)));

    const double mu = fluid->viscosity(value_of(P0));
    const bool falling = u.memory(0) != 0;
    const hydraulic::Regime regime =
        hydraulic::select_regime(pipe.reynolds(value_of(qm), mu), falling);
    const T friction1 =
        pipe.friction(T(0.75 * q1 + 0.25 * q2), mu, regime, falling) / (0.5 * (rho1 + rho0));
    const T friction2 =
        pipe.friction(T(0.25 * q1 + 0.75 * q2), mu, regime, falling) / (0.5 * (rho0 + rho2));
    const T pressure = 0.5 * A * (P2 - P1);
    const T mean = qm * qm / (rho0 * A);
    r.own(0, L / 8 * (3.0 * u.own_rate(2) + u.own_rate(3)) + mean - q1 * q1 / (rho1 * A) +
                 pressure + friction1);
    r.own(1, L / 8 * (u.own_rate(2) + 3.0 * u.own_rate(3)) + q2 * q2 / (rho2 * A) - mean +
                 pressure + friction2);
    r.own(2, u.scalar(0) - P1);
    r.own(3, u.scalar(1) - P2);
  }

  void after_convergence(const Local<double>& u, State& state) const {
    double& flag = state.memory[u.memory_offset()];
    flag = hydraulic::update_turbulent(reynolds(u), flag != 0);
  }
  void output(const Local<double>& u, OutputRow& row) const;
  std::string row_name(int k) const;
};

}  // namespace mbcosim
