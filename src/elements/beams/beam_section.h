/// Kinematics and internal forces at a beam's evaluation points, in any scalar type: included where
/// they are made of one.
#pragma once

#include "elements/beams/beam.h"

namespace mbcosim {

/// Σ weight_k · value_k.
template <int Nodes, class T>
inline Vec<T> interpolate(const double (&weight)[Nodes], const Vec<T> (&value)[Nodes]) {
  Vec<T> sum = value[0] * weight[0];
  for (int k = 1; k < Nodes; ++k) sum += value[k] * weight[k];
  return sum;
}

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
inline typename Beam<Nodes>::template Line<T> Beam<Nodes>::line(const Local<T>& u) const {
  const bool assembling = u.context->phase == Phase::assembly;
  Line<T> along;
  for (int k = 0; k < Nodes; ++k) {
    const Vec<T> arm = u.R(k) * offset[k].template cast<T>();
    along.x[k] = u.x(k) + arm;
    along.g[k] = assembling ? total_parameters(u, k) : u.g(k);
    if (!viscoelastic || assembling) continue;
    along.v[k] = u.v(k) + u.w(k).cross(arm);
    along.gp[k] = u.gp(k);
  }
  return along;
}

template <int Nodes>
template <class T>
inline typename Beam<Nodes>::template Increment<T> Beam<Nodes>::increment(const Vec<T> (&g)[Nodes],
                                                                          const Vec<T> (&gp)[Nodes],
                                                                          bool with_rates,
                                                                          int a) const {
  using Shape = BeamShape<Nodes>;
  Increment<T> i;
  i.r = interpolate(Shape::n[a], g);
  i.dr = interpolate(Shape::dn[a], g) * point[a].metric;
  if (with_rates) {
    i.rp = interpolate(Shape::n[a], gp);
    i.drp = interpolate(Shape::dn[a], gp) * point[a].metric;
  } else {
    i.rp = i.drp = Vec<T>::Constant(T(0.0));
  }
  return i;
}

template <int Nodes>
template <class T>
Section<T> Beam<Nodes>::section(const Local<T>& u, const Line<T>& along, int a) const {
  using Shape = BeamShape<Nodes>;
  const Point& q = point[a];
  const bool assembling = u.context->phase == Phase::assembly;
  const SectionHistory<const double> past(
      &u.context->state->memory[u.memory_offset() + a * kSectionHistory]);
  const Vec3 k_ref = assembling ? Vec3(Vec3::Zero()) : Vec3(past.k_ref);
  const Mat3 R_ref = assembling ? q.R0 : Mat3(past.R_ref);

  const Increment<T> i = increment(along, assembling, a);
  const Mat<T> G = cgr_g(i.r), rotation = cgr_rotation(i.r);
  const Vec<T> bend = G * i.dr;  // G(r) r′

  Section<T> s;
  s.p = interpolate(Shape::n[a], along.x);
  s.l = interpolate(Shape::dn[a], along.x) * q.metric;
  s.R = rotation * R_ref.template cast<T>();
  s.strain.template head<3>() = s.R.transpose() * s.l - q.l0.template cast<T>();
  s.strain.template tail<3>() = s.R.transpose() * bend + k_ref.template cast<T>();
  s.rate.setConstant(T(0.0));
  s.w.setConstant(T(0.0));
  if (!viscoelastic || assembling) return s;

  const Vec<T> lp = interpolate(Shape::dn[a], along.v) * q.metric;
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

}  // namespace mbcosim
