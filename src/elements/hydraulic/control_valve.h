/// Four-way control valves whose state is imposed.
#pragma once

#include <algorithm>
#include <array>

#include "elements/hydraulic/hydraulic_laws.h"
#include "model/fluid.h"

namespace mbcosim {

namespace hydraulic {

/// Passages of a four-way valve: from node 1 (supply) and node 4 (return) to nodes 2 and 3; 1–4 and
/// 2–3 leak.
enum Passage { k12, k34, k13, k24, k14, k23, kPassages };

/// Flow out of each node for the flows qᵢⱼ [kg/s] from node i to node j.
template <class T>
std::array<T, 4> node_balance(const std::array<T, kPassages>& q) {
  return {T(q[k12] + q[k13] + q[k14]), T(q[k23] + q[k24] - q[k12]), T(q[k34] - q[k13] - q[k23]),
          T(-q[k14] - q[k24] - q[k34])};
}

}  // namespace hydraulic

/// Valve with the opening s = clip(drive, −1, 1), the maximal area A and the leakage k A:
///
///   s > 0:  A₁₂ = A₃₄ = s A + 2 k A,  A₁₃ = A₂₄ = k A
///   s ≤ 0:  A₁₂ = A₃₄ = 2 k A,        A₁₃ = A₂₄ = −s A + k A
///   qᵢⱼ = C_d Aᵢⱼ sgn(pᵢ−pⱼ) √(2 ρ |pᵢ−pⱼ|)   [kg/s]
///
/// `control valve`: C_d = π/(π+2), ρ the reference density. `control valve 2`: also A₁₄ = A₂₃ = k
/// A, C_d = 0.611, ρ at the mean of the four pressures. N.B.: MBDyn solves the second one for the
/// six flows by badly scaled equations; the flows here are its closed form, to which its results
/// come as near as its tolerance allows. Source: MBDyn input manual, hydraulic control valve.
struct ControlValve {
  int node[4];
  double max_area;  ///< A [m²]
  double leakage;   ///< k, fraction of A
  DrivePtr state;
  FluidPtr fluid;
  bool six_passages;  ///< `control valve 2`

  static constexpr int width = 4;
  void connect(Connector& c) {
    for (const int n : node) c.scalar(n);
  }
  double opening(const EvalContext& context) const {
    return std::clamp(state->value(context), -1.0, 1.0);
  }
  std::array<double, hydraulic::kPassages> areas(double s) const;

  template <class T>
  std::array<T, 4> flows(const Local<T>& u, double s) const {
    const double cd = six_passages ? 0.611 : M_PI / (M_PI + 2);
    const T p1 = u.scalar(0), p2 = u.scalar(1), p3 = u.scalar(2), p4 = u.scalar(3);
    const T rho = six_passages ? fluid->density(T(0.25 * (p1 + p2 + p3 + p4)))
                               : T(fluid->reference_density());
    const std::array<double, hydraulic::kPassages> area = areas(s);
    const std::array<T, hydraulic::kPassages> jump = {T(p1 - p2), T(p3 - p4), T(p1 - p3),
                                                      T(p2 - p4), T(p1 - p4), T(p2 - p3)};
    std::array<T, hydraulic::kPassages> q;
    for (int k = 0; k < hydraulic::kPassages; ++k)
      q[k] = hydraulic::turbulent_flow(cd * area[k], rho, jump[k]);
    return hydraulic::node_balance(q);
  }
  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    const std::array<T, 4> out = flows(u, opening(*u.context));
    for (int k = 0; k < 4; ++k) r.scalar(k, out[k]);
  }
  void output(const Local<double>& u, OutputRow& row) const;
};

}  // namespace mbcosim
