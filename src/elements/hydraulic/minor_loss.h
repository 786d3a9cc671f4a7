/// Local pressure losses: bends, fittings, T junctions.
#pragma once

#include "elements/hydraulic/hydraulic_laws.h"
#include "model/fluid.h"

namespace mbcosim {

/// q = A √(2 ρ/K) sgn(p₁−p₂) √|p₁−p₂| [kg/s] from node 1 to node 2; K depends on the direction of
/// the flow, ρ is that of the mean pressure. Source: MBDyn input manual, hydraulic minor loss.
struct MinorLoss {
  int node1, node2;
  double K12, K21;  ///< loss coefficients for either direction, > 0
  double area;      ///< [m²]
  FluidPtr fluid;

  static constexpr int width = 2;
  void connect(Connector& c) {
    c.scalar(node1);
    c.scalar(node2);
  }
  template <class T>
  T flow(const Local<T>& u) const {
    const T dp = u.scalar(0) - u.scalar(1);
    const T rho = fluid->density(T(0.5 * (u.scalar(0) + u.scalar(1))));
    const double K = dp > 0 ? K12 : K21;
    return hydraulic::turbulent_flow(area / std::sqrt(K), rho, dp);
  }
  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    const T q = flow(u);
    r.scalar(0, q);
    r.scalar(1, -q);
  }
  void output(const Local<double>& u, OutputRow& row) const;
};

/// T junction. Only the branch n with the higher pressure of nodes 1 and 2 (node 2 if equal) is
/// active:
///
///   q = Aₙ √(2 ρ/K) sgn(p₀−pₙ) √|p₀−pₙ|  from node 0 to node n,  K = K_out if p₀ > pₙ, else K_in
///
/// with ρ at (p₀+pₙ)/2. N.B.: this is what MBDyn does, not what its manual says.
struct ThreeWayMinorLoss {
  int node0, node1, node2;
  double K_out, K_in;   ///< > 0
  double area1, area2;  ///< [m²]
  FluidPtr fluid;

  static constexpr int width = 3;
  void connect(Connector& c) {
    c.scalar(node0);
    c.scalar(node1);
    c.scalar(node2);
  }
  template <class T>
  static int active_branch(const Local<T>& u) {
    return u.scalar(1) > u.scalar(2) ? 1 : 2;
  }
  double area(int branch) const { return branch == 1 ? area1 : area2; }
  template <class T>
  T flow(const Local<T>& u, int branch) const {
    const T dp = u.scalar(0) - u.scalar(branch);
    const T rho = fluid->density(T(0.5 * (u.scalar(0) + u.scalar(branch))));
    const double K = dp > 0 ? K_out : K_in;
    return hydraulic::turbulent_flow(area(branch) / std::sqrt(K), rho, dp);
  }
  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    const int branch = active_branch(u);
    const T q = flow(u, branch);
    r.scalar(0, q);
    r.scalar(branch, -q);
  }
  void output(const Local<double>& u, OutputRow& row) const;
};

}  // namespace mbcosim
