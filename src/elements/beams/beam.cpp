#include "elements/beams/beam_section.h"

#include <algorithm>
#include <limits>

namespace mbcosim {

template <int Nodes>
void Beam<Nodes>::after_predict(const Local<double>& u, State& state) const {
  Vec3 r[Nodes], rp[Nodes];
  for (int k = 0; k < Nodes; ++k) {
    const NodeRotationHistory& q = state.rotation_history[u.connection->node[k]];
    r[k] = cgr_parameters<double>(q.R_ref * q.R1.transpose());
    rp[k] = cgr_g_inverse(r[k]) * q.w_ref;
  }
  for (int a = 0; a < points; ++a) {
    SectionHistory<double> h(&state.memory[u.memory_offset() + a * kSectionHistory]);
    const Increment<double> i = increment(r, rp, true, a);
    const Mat3 G = cgr_g(i.r);
    const Vec3 bend = G * i.dr;
    h.R_ref = cgr_rotation(i.r) * h.R;
    h.k_ref = h.R_ref.transpose() * bend + h.k;
    h.w_ref = G * i.rp;
    h.kp_ref = h.R_ref.transpose() * (G * i.drp + bend.cross(Vec3(h.w_ref)));
  }
  state.memory[u.memory_offset() + kMemory - 1] = 1;
  tell_laws_of_prediction(u, state);
}

template <int Nodes>
void Beam<Nodes>::tell_laws_of_prediction(const Local<double>& u, State& state) const {
  for (int a = 0; a < points; ++a) {
    if (!point[a].law->has_memory()) continue;
    const Section<double> s = section(u, line(u), a);
    point[a].law->after_predict(*u.context, state, s.strain, s.rate);
  }
}

template <int Nodes>
void Beam<Nodes>::at_derivatives(const Local<double>& u, State& state, bool first) const {
  if (first == is_unloaded(u)) return;
  state.memory[u.memory_offset() + kMemory - 1] = 1;
  tell_laws_of_prediction(u, state);
}

template <int Nodes>
void Beam<Nodes>::after_convergence(const Local<double>& u, State& state) const {
  const Line<double> along = line(u);
  for (int a = 0; a < points; ++a) {
    const Section<double> s = section(u, along, a);
    SectionHistory<double> h(&state.memory[u.memory_offset() + a * kSectionHistory]);
    h.R = s.R;
    h.k = s.strain.template tail<3>();
    if (point[a].law->has_memory())
      point[a].law->after_convergence(*u.context, state, s.strain, s.rate);
  }
}

template <int Nodes>
bool Beam<Nodes>::stages_apart() const {
  return std::none_of(point.begin(), point.end(),
                      [](const Point& p) { return p.law->has_memory(); });
}

/// Takes the nodes as they are: the rotations from the orientations as read to the current ones are
/// interpolated.
template <int Nodes>
void Beam<Nodes>::restart(const Local<double>& u, State& state) const {
  using Shape = BeamShape<Nodes>;
  Vec3 g[Nodes], w[Nodes];
  for (int k = 0; k < Nodes; ++k) {
    g[k] = total_parameters(u, k);
    w[k] = u.w(k);
  }
  for (int a = 0; a < points; ++a) {
    const double m = point[a].metric;
    const Vec3 r = interpolate(Shape::n[a], g), dr = m * interpolate(Shape::dn[a], g);
    SectionHistory<double> h(&state.memory[u.memory_offset() + a * kSectionHistory]);
    const Vec3 bend = cgr_g(r) * dr;
    h.R = h.R_ref = cgr_rotation(r) * point[a].R0;
    h.k = h.k_ref = h.R.transpose() * bend;
    h.w_ref = interpolate(Shape::n[a], w);
    h.kp_ref = h.R.transpose() * (m * interpolate(Shape::dn[a], w) + bend.cross(Vec3(h.w_ref)));
  }
}

template <int Nodes>
void Beam<Nodes>::start(Start& s) const {
  restart(s.u, s.state);
  // After an initial assembly, or when a drive switches the beam on, there is no prediction to wait
  // for.
  s.memory(kMemory - 1) = s.u.context->phase == Phase::step || !s.u.model().control.skip_assembly;
}

template <int Nodes>
double Beam<Nodes>::set_geometry(const Model& model) {
  using Shape = BeamShape<Nodes>;
  double smallest = std::numeric_limits<double>::infinity();
  Vec3 X[Nodes];
  for (int k = 0; k < Nodes; ++k) {
    const StructuralNode& n = model.structural[node[k]];
    X[k] = n.x + n.R * offset[k];
  }
  for (int a = 0; a < points; ++a) {
    const Vec3 slope = interpolate(Shape::dn[a], X);
    smallest = std::min(smallest, slope.squaredNorm());
    point[a].metric = 1 / slope.norm();
    point[a].l0 = point[a].R0.transpose() * slope * point[a].metric;
  }
  return smallest;
}

template struct Beam<2>;
template struct Beam<3>;
#define MBCOSIM_INSTANTIATE(Nodes)                                                              \
  template void Beam<Nodes>::residual(const Local<double>&, Residual<double>&) const;           \
  template Beam<Nodes>::Line<double> Beam<Nodes>::line(const Local<double>&) const;             \
  template Section<double> Beam<Nodes>::section(const Local<double>&, const Line<double>&, int) \
      const;                                                                                    \
  template Vec6 Beam<Nodes>::internal_force(const Local<double>&, int, const Section<double>&)  \
      const;
MBCOSIM_INSTANTIATE(2)
MBCOSIM_INSTANTIATE(3)
#undef MBCOSIM_INSTANTIATE

}  // namespace mbcosim
