// Closed-form linearization of beams.
#include "elements/beams/beam_section.h"
#include "math/rotation_derivative.h"

namespace mbcosim {

namespace {

using Mat63 = Eigen::Matrix<double, 6, 3>;

Mat63 stacked(const Mat3& force, const Mat3& moment) {
  Mat63 m;
  m << force, moment;
  return m;
}

/// diag(R, R) K diag(R, R)ᵀ.
Mat6 rotated(const Mat3& R, const Mat6& K) {
  Mat6 g;
  for (int i = 0; i < 6; i += 3)
    for (int j = 0; j < 6; j += 3)
      g.block<3, 3>(i, j) = R * Mat3(K.block<3, 3>(i, j)) * R.transpose();
  return g;
}

/// K (ε; κ), by blocks of three columns.
Mat63 product(const Mat6& K, const Mat3& strain, const Mat3& curvature) {
  Mat63 f;
  for (int i = 0; i < 6; i += 3)
    f.middleRows<3>(i) = K.block<3, 3>(i, 0) * strain + K.block<3, 3>(i, 3) * curvature;
  return f;
}

Mat63 product(const Mat6& K, const Mat3& strain) {
  Mat63 f;
  for (int i = 0; i < 6; i += 3) f.middleRows<3>(i) = K.block<3, 3>(i, 0) * strain;
  return f;
}

}  // namespace

/// Derivatives of (F, M) at one evaluation point, global frame, with R the section's orientation,
/// K = ∂(F, M)/∂(ε, κ) and D = ∂(F, M)/∂(ε̇, κ̇) rotated to it, [a]× the skew matrix of a. A node
/// enters through its weights N and m N′ alone, so that all but its offset is computed once:
///
///   R δε = δl + [l]× δθ,   R δκ = δ(G r′) + [G r′]× δθ,   δθ = G δr
///   R δε̇ = δl̇ − [w]× δl + [l]× δw + [l̇ + l × w]× δθ,   R δκ̇ likewise from G ṙ′ + (G r′) × w
template <int Nodes>
struct Beam<Nodes>::PointTangent {
  Section<double> s;
  Mat6 K, D;   ///< D: viscoelastic beams only
  Mat63 x_dn;  ///< by m N′ δx of a node
  Mat63 g_n;   ///< by N δg
  Mat63 g_dn;  ///< by m N′ δg
  Mat3 F;      ///< [F]×
  Vec6 force;  ///< (F, M), global, with the actuators' part
};

template <int Nodes>
typename Beam<Nodes>::PointTangent Beam<Nodes>::point_tangent(const Local<double>& u,
                                                              const Tangent& t,
                                                              const Line<double>& along,
                                                              int a) const {
  const double c = t.c;
  PointTangent p;
  p.s = section(u, along, a);
  Law<6>::Response law;
  point[a].law->respond(*u.context, p.s.strain, p.s.rate, true, law);
  for (int j = 0; j < static_cast<int>(actuators.size()); ++j)
    law.f += u.scalar(j) * point[a].actuation.col(j);
  const Increment<double> i = increment(along, u.context->phase == Phase::assembly, a);
  const Mat3& R = p.s.R;
  p.force << R * law.f.template head<3>(), R * law.f.template tail<3>();
  p.F = cross<double>(p.force.template head<3>());
  p.K = rotated(R, law.de);

  const Mat3 G = cgr_g(i.r), cG = c * G;
  const Vec3 bend = G * i.dr;
  const Mat3 l = cross(p.s.l), b = cross(bend), dG_dr = c * cgr_g_derivative(i.r, i.dr);
  p.x_dn = c * p.K.template leftCols<3>();
  p.g_n = product(p.K, l * cG, dG_dr + b * cG) -
          stacked(p.F * cG, cross<double>(p.force.template tail<3>()) * cG);
  p.g_dn = p.K.template rightCols<3>() * cG;
  if (viscoelastic) add_rate(u, t, a, i, law.dep, p);
  return p;
}

/// The dependence through the strain rates.
template <int Nodes>
void Beam<Nodes>::add_rate(const Local<double>& u, const Tangent& t, int a,
                           const Increment<double>& i, const Mat6& damping, PointTangent& p) const {
  const double c = t.c;
  const SectionHistory<const double> past(
      &u.context->state->memory[u.memory_offset() + a * kSectionHistory]);
  const Mat3 G = cgr_g(i.r), cG = c * G, w = cross(p.s.w), l = cross(p.s.l);
  const Vec3 bend = G * i.dr;
  const Mat3 dw = G + c * cgr_g_derivative(i.r, i.rp) -
                  cross<double>(cgr_rotation(i.r) * Vec3(past.w_ref)) * cG;  // δw by N δg
  const Mat3 slope_rate = cross<double>(p.s.R * p.s.rate.template head<3>());  // l̇ + l × w = R ε̇
  const Mat3 bend_rate = cross<double>(G * i.drp + bend.cross(p.s.w));
  p.D = rotated(p.s.R, damping);
  p.x_dn += product(p.D, Mat3::Identity() - c * w);
  p.g_n += product(p.D, l * dw + slope_rate * cG,
                   c * (cgr_g_derivative(i.r, i.drp) - w * cgr_g_derivative(i.r, i.dr)) +
                       cross(bend) * dw + bend_rate * cG);
  p.g_dn += p.D.template rightCols<3>() * (G - w * cG);
}

/// δ(F, M + δp × F) by the increments (x, g) of node k, global, 6 × 6.
template <int Nodes>
Mat6 Beam<Nodes>::force_by_node(const Local<double>& u, const Tangent& t, const PointTangent& p,
                                int a, int k) const {
  const double n = BeamShape<Nodes>::n[a][k], dn = BeamShape<Nodes>::dn[a][k] * point[a].metric,
               c = t.c;
  Mat6 f;
  f.template leftCols<3>() = dn * p.x_dn;
  f.template rightCols<3>() = n * p.g_n + dn * p.g_dn;
  f.template block<3, 3>(3, 0) -= (c * n) * p.F;
  if (offset[k].isZero(0)) return f;
  const Mat3 arm = cross<double>(u.R(k) * offset[k]), darm = -arm * t.seeds[k].A;
  f.template rightCols<3>() += product(p.K, dn * darm);
  f.template block<3, 3>(3, 3) -= n * p.F * darm;
  if (viscoelastic)
    f.template rightCols<3>() +=
        product(p.D, dn * ((cross(u.w(k)) - cross(p.s.w)) * darm - arm * t.seeds[k].B));
  return f;
}

/// Rows of the two nodes beside point a: load (F, M + (p − x) × F) and its opposite. A beam that
/// has not been loaded yet is stiff nonetheless: modes about the initial state need it.
template <int Nodes>
void Beam<Nodes>::tangent(const Local<double>& u, Tangent& t) const {
  const Line<double> along = line(u);
  for (int a = 0; a < points; ++a) {
    const PointTangent p = point_tangent(u, t, along, a);
    const Vec3 reach[2] = {p.s.p - u.x(a), p.s.p - u.x(a + 1)};
    const auto add = [&](int column, const Vec6& f) {
      for (int side = 0; side < 2; ++side) {
        const double sign = side == 0 ? -1 : 1;  // the matrix is −∂r/∂δ
        double* const rows = &t.at(t.row_node(a + side), column);
        const Vec3 moment = f.tail<3>() + reach[side].cross(f.head<3>());
        for (int i = 0; i < 3; ++i) {
          rows[i] += sign * f(i);
          rows[3 + i] += sign * moment(i);
        }
      }
    };
    for (int k = 0; k < Nodes; ++k) {
      const Mat6 f = force_by_node(u, t, p, a, k);
      for (int j = 0; j < 6; ++j) add(t.col_node(k) + j, f.col(j));
    }
    t.block(t.row_node(a) + 3, t.col_node(a)) -= t.c * p.F;  // −δx × F
    t.block(t.row_node(a + 1) + 3, t.col_node(a + 1)) += t.c * p.F;
    for (int j = 0; j < static_cast<int>(actuators.size()); ++j) {
      const Vec6 local = t.c * point[a].actuation.col(j);
      Vec6 f;
      f << p.s.R * local.head<3>(), p.s.R * local.tail<3>();
      add(t.col_scalar(j), f);
    }
  }
}

template void Beam<2>::tangent(const Local<double>&, Tangent&) const;
template void Beam<3>::tangent(const Local<double>&, Tangent&) const;

}  // namespace mbcosim
