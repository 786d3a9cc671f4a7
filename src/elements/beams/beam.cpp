#include "elements/beams/beam.h"

#include <limits>

namespace mbcosim {

namespace {

/// Σ weight_k · value_k.
template <int Nodes, class Get>
auto interpolate(const double (&weight)[Nodes], Get value) {
  auto sum = (value(0) * weight[0]).eval();
  for (int k = 1; k < Nodes; ++k) sum += value(k) * weight[k];
  return sum;
}

}  // namespace

template <int Nodes>
template <class T>
Vec<T> Beam<Nodes>::total_parameters(const Local<T>& u, int k) {
  const Mat3& input = u.model().structural[u.connection->node[k]].R;
  if (value_of(u.R(k)) ==
      input) {  // exact zero; the derivative of g(R) at the identity is the rotation vector's
    Mat<T> r = u.R(k) * Mat3(input.transpose()).template cast<T>();
    const Vec<T> a = ax(r);
    return a - value_of(a).template cast<T>();
  }
  return cgr_parameters(Mat<T>(u.R(k) * Mat3(input.transpose()).template cast<T>()));
}

template <int Nodes>
template <class T>
typename Beam<Nodes>::template Increment<T> Beam<Nodes>::increment(const Local<T>& u, int a) const {
  using Shape = BeamShape<Nodes>;
  const bool assembling = u.context->phase == Phase::assembly;
  const auto g = [&](int k) -> Vec<T> { return assembling ? total_parameters(u, k) : u.g(k); };
  const auto gp = [&](int k) -> Vec<T> { return u.gp(k); };
  Increment<T> i;
  i.r = interpolate(Shape::n[a], g);
  i.dr = interpolate(Shape::dn[a], g) * point[a].metric;
  if (viscoelastic && !assembling) {
    i.rp = interpolate(Shape::n[a], gp);
    i.drp = interpolate(Shape::dn[a], gp) * point[a].metric;
  } else {
    i.rp = i.drp = Vec<T>::Constant(T(0.0));
  }
  return i;
}

template <int Nodes>
template <class T>
Section<T> Beam<Nodes>::section(const Local<T>& u, int a) const {
  using Shape = BeamShape<Nodes>;
  const Point& q = point[a];
  const bool assembling = u.context->phase == Phase::assembly;
  const SectionHistory<const double> past(
      &u.context->state->memory[u.memory_offset() + a * kSectionHistory]);
  const Vec3 k_ref = assembling ? Vec3(Vec3::Zero()) : Vec3(past.k_ref);
  const Mat3 R_ref = assembling ? q.R0 : Mat3(past.R_ref);

  Vec<T> arm[Nodes];
  for (int k = 0; k < Nodes; ++k) arm[k] = u.R(k) * offset[k].template cast<T>();
  const auto X = [&](int k) -> Vec<T> { return u.x(k) + arm[k]; };
  const Increment<T> i = increment(u, a);
  const Mat<T> G = cgr_g(i.r), rotation = cgr_rotation(i.r);
  const Vec<T> bend = G * i.dr;  // G(r) r′

  Section<T> s;
  s.p = interpolate(Shape::n[a], X);
  s.l = interpolate(Shape::dn[a], X) * q.metric;
  s.R = rotation * R_ref.template cast<T>();
  s.strain.template head<3>() = s.R.transpose() * s.l - q.l0.template cast<T>();
  s.strain.template tail<3>() = s.R.transpose() * bend + k_ref.template cast<T>();
  s.rate.setConstant(T(0.0));
  s.w.setConstant(T(0.0));
  if (!viscoelastic || assembling) return s;

  const auto V = [&](int k) -> Vec<T> { return u.v(k) + u.w(k).cross(arm[k]); };
  const Vec<T> lp = interpolate(Shape::dn[a], V) * q.metric;
  s.w = G * i.rp + rotation * Vec3(past.w_ref).template cast<T>();
  s.rate.template head<3>() = s.R.transpose() * Vec<T>(lp + s.l.cross(s.w));
  s.rate.template tail<3>() =
      s.R.transpose() * Vec<T>(G * i.drp + bend.cross(s.w)) + Vec3(past.kp_ref).template cast<T>();
  return s;
}

template <int Nodes>
template <class T>
Eigen::Matrix<T, 6, 1> Beam<Nodes>::internal_force(const Local<T>& u, int a,
                                                   const Section<T>& s) const {
  Eigen::Matrix<T, 6, 1> f = point[a].law->template force<T>(*u.context, s.strain, s.rate);
  for (int j = 0; j < static_cast<int>(actuators.size()); ++j)
    for (int i = 0; i < 6; ++i) f(i) += u.scalar(j) * point[a].actuation(i, j);
  return f;
}

template <int Nodes>
typename Beam<Nodes>::template Increment<double> Beam<Nodes>::predicted_increment(
    const Local<double>& u, const State& state, int a) const {
  using Shape = BeamShape<Nodes>;
  Vec3 r[Nodes], rp[Nodes];
  for (int k = 0; k < Nodes; ++k) {
    const NodeRotationHistory& q = state.rotation_history[u.connection->node[k]];
    r[k] = cgr_parameters<double>(q.R_ref * q.R1.transpose());
    rp[k] = cgr_g_inverse(r[k]) * q.w_ref;
  }
  const double m = point[a].metric;
  return {interpolate(Shape::n[a], [&](int k) { return r[k]; }),
          m * interpolate(Shape::dn[a], [&](int k) { return r[k]; }),
          interpolate(Shape::n[a], [&](int k) { return rp[k]; }),
          m * interpolate(Shape::dn[a], [&](int k) { return rp[k]; })};
}

template <int Nodes>
void Beam<Nodes>::after_predict(const Local<double>& u, State& state) const {
  for (int a = 0; a < points; ++a) {
    SectionHistory<double> h(&state.memory[u.memory_offset() + a * kSectionHistory]);
    const Increment<double> i = predicted_increment(u, state, a);
    const Mat3 G = cgr_g(i.r);
    const Vec3 bend = G * i.dr;
    h.R_ref = cgr_rotation(i.r) * h.R;
    h.k_ref = h.R_ref.transpose() * bend + h.k;
    h.w_ref = G * i.rp;
    h.kp_ref = h.R_ref.transpose() * (G * i.drp + bend.cross(Vec3(h.w_ref)));
  }
  state.memory[u.memory_offset() + kMemory - 1] = 1;
  for (int a = 0; a < points; ++a) {
    const Section<double> s = section(u, a);
    point[a].law->after_predict(*u.context, state, s.strain, s.rate);
  }
}

template <int Nodes>
void Beam<Nodes>::after_convergence(const Local<double>& u, State& state) const {
  for (int a = 0; a < points; ++a) {
    const Section<double> s = section(u, a);
    SectionHistory<double> h(&state.memory[u.memory_offset() + a * kSectionHistory]);
    h.R = s.R;
    h.k = s.strain.template tail<3>();
    point[a].law->after_convergence(*u.context, state, s.strain, s.rate);
  }
}

/// Takes the nodes as they are: the rotations from the orientations as read to the current ones are
/// interpolated.
template <int Nodes>
void Beam<Nodes>::restart(const Local<double>& u, State& state) const {
  using Shape = BeamShape<Nodes>;
  for (int a = 0; a < points; ++a) {
    const double m = point[a].metric;
    const auto g = [&](int k) { return total_parameters(u, k); };
    const auto w = [&](int k) { return u.w(k); };
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
  const auto X = [&](int k) -> Vec3 {
    const StructuralNode& n = model.structural[node[k]];
    return n.x + n.R * offset[k];
  };
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
template Beam<2>::Increment<double> Beam<2>::increment(const Local<double>&, int) const;
template Beam<3>::Increment<double> Beam<3>::increment(const Local<double>&, int) const;
template Section<double> Beam<2>::section(const Local<double>&, int) const;
template Section<double> Beam<3>::section(const Local<double>&, int) const;
template Section<TimeDual> Beam<2>::section(const Local<TimeDual>&, int) const;
template Section<TimeDual> Beam<3>::section(const Local<TimeDual>&, int) const;
template Section<Dual<12>> Beam<2>::section(const Local<Dual<12>>&, int) const;
template Section<Dual<18>> Beam<3>::section(const Local<Dual<18>>&, int) const;
template Vec6 Beam<2>::internal_force(const Local<double>&, int, const Section<double>&) const;
template Vec6 Beam<3>::internal_force(const Local<double>&, int, const Section<double>&) const;
template Eigen::Matrix<TimeDual, 6, 1> Beam<2>::internal_force(const Local<TimeDual>&, int,
                                                               const Section<TimeDual>&) const;
template Eigen::Matrix<TimeDual, 6, 1> Beam<3>::internal_force(const Local<TimeDual>&, int,
                                                               const Section<TimeDual>&) const;
template Eigen::Matrix<Dual<12>, 6, 1> Beam<2>::internal_force(const Local<Dual<12>>&, int,
                                                               const Section<Dual<12>>&) const;
template Eigen::Matrix<Dual<18>, 6, 1> Beam<3>::internal_force(const Local<Dual<18>>&, int,
                                                               const Section<Dual<18>>&) const;

}  // namespace mbcosim
