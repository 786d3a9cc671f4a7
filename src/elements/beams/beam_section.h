/// Kinematics and internal forces at a beam's evaluation points, in any scalar type: included where
/// they are made of one.
#pragma once

#include "elements/beams/beam.h"

namespace mbcosim {

/// Σ weight_k · value_k.
template <int Nodes, class P, class T>
inline Vec<T> interpolate(const P (&weight)[Nodes], const Vec<T> (&value)[Nodes]) {
  Vec<T> sum = value[0] * weight[0];
  for (int k = 1; k < Nodes; ++k) sum += value[k] * weight[k];
  return sum;
}

/// What evaluation point `a` of the beam whose memory starts at `offset` remembers.
template <class Numbers>
inline auto history(Numbers& memory, int offset, int a) {
  return SectionHistory<std::remove_reference_t<decltype(memory[0])>>(
      &memory[offset + a * kSectionHistory]);
}

/// A vector or matrix that evaluation points from `a` on remember, of as many as `Wide` has lanes.
template <class Wide, class T, class Field>
inline Wide remembered(const Local<T>& u, int a, Field field) {
  return side_by_side<Wide>(
      [&](int k) { return history(u.context->state->memory, u.memory_offset(), a + k).*field; });
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
inline auto Beam<Nodes>::line(const Local<T>& u) const -> Line<Wide<T>> {
  using W = Wide<T>;
  const bool assembling = u.context->phase == Phase::assembly;
  Line<W> along;
  for (int k = 0; k < Nodes; ++k) {
    const Vec<T> arm = u.R(k) * offset[k].template cast<T>();
    along.x[k] = Vec<T>(u.x(k) + arm).template cast<W>();
    along.g[k] = (assembling ? total_parameters(u, k) : u.g(k)).template cast<W>();
    if (!viscoelastic || assembling) continue;
    along.v[k] = Vec<T>(u.v(k) + u.w(k).cross(arm)).template cast<W>();
    along.gp[k] = u.gp(k).template cast<W>();
  }
  return along;
}

template <int Nodes>
template <class P>
inline auto Beam<Nodes>::place(int a) const -> Place<P> {
  using Shape = BeamShape<Nodes>;
  Place<P> at;
  for (int j = 0; j < Nodes; ++j) {
    at.n[j] = side_by_side<P>([&](int k) { return Shape::n[a + k][j]; });
    at.dn[j] = side_by_side<P>([&](int k) { return Shape::dn[a + k][j]; });
  }
  at.metric = side_by_side<P>([&](int k) { return point[a + k].metric; });
  at.l0 = side_by_side<Vec<P>>([&](int k) -> const Vec3& { return point[a + k].l0; });
  return at;
}

template <int Nodes>
template <class T, class P>
inline auto Beam<Nodes>::increment(const Vec<T> (&g)[Nodes], const Vec<T> (&gp)[Nodes],
                                   bool with_rates, const Place<P>& at) -> Increment<T> {
  Increment<T> i;
  i.r = interpolate(at.n, g);
  i.dr = interpolate(at.dn, g) * at.metric;
  if (with_rates) {
    i.rp = interpolate(at.n, gp);
    i.drp = interpolate(at.dn, gp) * at.metric;
  } else {
    i.rp = i.drp = Vec<T>::Constant(T(0.0));
  }
  return i;
}

template <int Nodes>
template <class T>
auto Beam<Nodes>::section(const Local<T>& u, const Line<Wide<T>>& along, int a) const
    -> Section<Wide<T>> {
  using W = Wide<T>;
  using P = Plain<W>;
  using Past = SectionHistory<const double>;
  const Place<P> at = place<P>(a);
  const bool assembling = u.context->phase == Phase::assembly;
  Vec<P> k_ref = Vec<P>::Constant(P(0.0));
  Mat<P> R_ref;
  if (assembling) {
    R_ref = side_by_side<Mat<P>>([&](int k) -> const Mat3& { return point[a + k].R0; });
  } else {
    k_ref = remembered<Vec<P>>(u, a, &Past::k_ref);
    R_ref = remembered<Mat<P>>(u, a, &Past::R_ref);
  }

  const Increment<W> i = increment(along.g, along.gp, viscoelastic && !assembling, at);
  const Mat<W> G = cgr_g(i.r), rotation = cgr_rotation(i.r);
  const Vec<W> bend = G * i.dr;  // G(r) r′

  Section<W> s;
  s.p = interpolate(at.n, along.x);
  s.l = interpolate(at.dn, along.x) * at.metric;
  s.R = rotation * R_ref.template cast<W>();
  s.strain.template head<3>() = s.R.transpose() * s.l - at.l0.template cast<W>();
  s.strain.template tail<3>() = s.R.transpose() * bend + k_ref.template cast<W>();
  s.rate.setConstant(W(0.0));
  s.w.setConstant(W(0.0));
  if (!viscoelastic || assembling) return s;

  const Vec<W> lp = interpolate(at.dn, along.v) * at.metric;
  s.w = G * i.rp + rotation * remembered<Vec<P>>(u, a, &Past::w_ref).template cast<W>();
  s.rate.template head<3>() = s.R.transpose() * Vec<W>(lp + s.l.cross(s.w));
  s.rate.template tail<3>() = s.R.transpose() * Vec<W>(G * i.drp + bend.cross(s.w)) +
                              remembered<Vec<P>>(u, a, &Past::kp_ref).template cast<W>();
  return s;
}

template <int Nodes>
template <class T>
auto Beam<Nodes>::internal_force(const Local<T>& u, int a, const Section<Wide<T>>& s) const
    -> Eigen::Matrix<Wide<T>, 6, 1> {
  using One = Eigen::Matrix<T, 6, 1>;
  return side_by_side<Eigen::Matrix<Wide<T>, 6, 1>>([&](int k) {
    One f = point[a + k].law->template force<T>(*u.context, One(lane(s.strain, k)),
                                                One(lane(s.rate, k)));
    for (int j = 0; j < static_cast<int>(actuators.size()); ++j)
      for (int i = 0; i < 6; ++i) f(i) += u.scalar(j) * point[a + k].actuation(i, j);
    return f;
  });
}

}  // namespace mbcosim
