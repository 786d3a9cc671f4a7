#include "elements/beams/beam_section.h"

#include <algorithm>
#include <limits>

namespace mbcosim {

template <int Nodes>
void Beam<Nodes>::after_predict(const Local<double>& u, State& state) const {
  using W = Wide<double>;
  using Past = SectionHistory<const double>;
  Vec<W> r[Nodes], rp[Nodes];
  for (int k = 0; k < Nodes; ++k) {
    const NodeRotationHistory& q = state.rotation_history[u.connection->node[k]];
    const Vec3 g = cgr_parameters<double>(q.R_ref * q.R1.transpose());
    r[k] = g.template cast<W>();
    rp[k] = Vec3(cgr_g_inverse(g) * q.w_ref).template cast<W>();
  }
  const Increment<W> i = increment(r, rp, true, place<W>(0));
  const Mat<W> G = cgr_g(i.r);
  const Vec<W> bend = G * i.dr, w_ref = G * i.rp;
  const Mat<W> R_ref = cgr_rotation(i.r) * remembered<Mat<W>>(u, 0, &Past::R);
  const Vec<W> k_ref = R_ref.transpose() * bend + remembered<Vec<W>>(u, 0, &Past::k);
  const Vec<W> kp_ref = R_ref.transpose() * Vec<W>(G * i.drp + bend.cross(w_ref));
  for (int a = 0; a < points; ++a) {
    auto h = history(state.memory, u.memory_offset(), a);
    h.R_ref = lane(R_ref, a);
    h.k_ref = lane(k_ref, a);
    h.w_ref = lane(w_ref, a);
    h.kp_ref = lane(kp_ref, a);
  }
  state.memory[u.memory_offset() + kMemory - 1] = 1;
  tell_laws_of_prediction(u, state);
}

template <int Nodes>
void Beam<Nodes>::tell_laws_of_prediction(const Local<double>& u, State& state) const {
  if (stages_apart()) return;  // none has a memory
  const auto s = section(u, line(u), 0);
  for (int a = 0; a < points; ++a)
    if (point[a].law->has_memory())
      point[a].law->after_predict(*u.context, state, lane(s.strain, a), lane(s.rate, a));
}

template <int Nodes>
void Beam<Nodes>::at_derivatives(const Local<double>& u, State& state, bool first) const {
  if (first == is_unloaded(u)) return;
  state.memory[u.memory_offset() + kMemory - 1] = 1;
  tell_laws_of_prediction(u, state);
}

template <int Nodes>
void Beam<Nodes>::after_convergence(const Local<double>& u, State& state) const {
  const auto s = section(u, line(u), 0);
  for (int a = 0; a < points; ++a) {
    auto h = history(state.memory, u.memory_offset(), a);
    h.R = lane(s.R, a);
    const Vec6 strain = lane(s.strain, a);
    h.k = strain.template tail<3>();
    if (point[a].law->has_memory())
      point[a].law->after_convergence(*u.context, state, strain, lane(s.rate, a));
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
    auto h = history(state.memory, u.memory_offset(), a);
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
#define MBCOSIM_INSTANTIATE(Nodes)                                                         \
  template void Beam<Nodes>::residual(const Local<double>&, Residual<double>&) const;      \
  template auto Beam<Nodes>::line(const Local<double>&) const->Line<Wide<double>>;         \
  template auto Beam<Nodes>::section(const Local<double>&, const Line<Wide<double>>&, int) \
      const->Section<Wide<double>>;                                                        \
  template auto Beam<Nodes>::internal_force(const Local<double>&, int,                     \
                                            const Section<Wide<double>>&)                  \
      const->Eigen::Matrix<Wide<double>, 6, 1>;
MBCOSIM_INSTANTIATE(2)
MBCOSIM_INSTANTIATE(3)
#undef MBCOSIM_INSTANTIATE

}  // namespace mbcosim
