// Closed-form linearization of beams.
#include "elements/beams/beam.h"

namespace mbcosim {

namespace {

/// ∂(G(r) q)/∂r for a constant q.
Mat3 cgr_g_derivative(const Vec3& r, const Vec3& q) {
  const double d = cgr_d(r);
  return -0.5 * d * d * (q + 0.5 * r.cross(q)) * r.transpose() - 0.5 * d * cross(q);
}

/// Adds to rows row..row+2 of the columns from `column` on.
template <class Block>
void add_rows(Tangent& t, int row, int column, const Block& values) {
  for (int j = 0; j < values.cols(); ++j)
    for (int i = 0; i < 3; ++i) t.at(row + i, column + j) += values(i, j);
}

}  // namespace

/// What the columns of all nodes share at one evaluation point. [a]× is the skew matrix of a.
template <int Nodes>
struct Beam<Nodes>::PointTangent {
  Section<double> s;
  Law<6>::Response law;  ///< with the actuators' part in f
  Mat3 G, Rt;            ///< G(r), Rᵀ
  Mat3 l, bend, F, M;    ///< [l]×, [G r′]×, [F]×, [M]× (global)
  Mat3 dG_dr;            ///< ∂(G r′)/∂r with r′ fixed
  // viscoelastic beams only
  Mat3 dG_rp, dG_drp;  ///< the same for ṙ, ṙ′
  Mat3 w, w_ref;       ///< [w]×, [Rot(r) w_ref]×
  Mat3 slope_rate;     ///< [l̇ + l × w]×
  Mat3 bend_rate;      ///< [G ṙ′ + (G r′) × w]×
};

template <int Nodes>
typename Beam<Nodes>::PointTangent Beam<Nodes>::point_tangent(const Local<double>& u, int a) const {
  PointTangent p;
  p.s = section(u, a);
  point[a].law->respond(*u.context, p.s.strain, p.s.rate, true, p.law);
  for (int j = 0; j < static_cast<int>(actuators.size()); ++j)
    p.law.f += u.scalar(j) * point[a].actuation.col(j);
  const Increment<double> i = increment(u, a);
  const Mat3& R = p.s.R;
  p.G = cgr_g(i.r);
  p.Rt = R.transpose();
  const Vec3 bend = p.G * i.dr;
  p.l = cross(p.s.l);
  p.bend = cross(bend);
  p.F = cross<double>(R * p.law.f.template head<3>());
  p.M = cross<double>(R * p.law.f.template tail<3>());
  p.dG_dr = cgr_g_derivative(i.r, i.dr);
  if (!viscoelastic) return p;
  const SectionHistory<const double> past(
      &u.context->state->memory[u.memory_offset() + a * kSectionHistory]);
  p.dG_rp = cgr_g_derivative(i.r, i.rp);
  p.dG_drp = cgr_g_derivative(i.r, i.drp);
  p.w = cross(p.s.w);
  p.w_ref = cross<double>(cgr_rotation(i.r) * Vec3(past.w_ref));
  p.slope_rate = cross<double>(R * p.s.rate.template head<3>());  // l̇ + l × w = R ε̇
  p.bend_rate = cross<double>(p.G * i.drp + bend.cross(p.s.w));
  return p;
}

/// δ(F, M) in the section frame by the increments (x, g) of node k, 6 × 6:
///
///   δε = Rᵀ (δl + [l]× δθ),   δκ = Rᵀ (δ(G r′) + [G r′]× δθ)
///   δε̇ = Rᵀ (δl̇ − [w]× δl + [l]× δw + [l̇ + l × w]× δθ),   δκ̇ likewise from G ṙ′ + (G r′) × w
template <int Nodes>
Mat6 Beam<Nodes>::force_by_node(const Local<double>& u, const Tangent& t, const PointTangent& p,
                                int a, int k) const {
  const double n = BeamShape<Nodes>::n[a][k], dn = BeamShape<Nodes>::dn[a][k] * point[a].metric,
               c = t.c;
  const Mat3 arm = cross<double>(u.R(k) * offset[k]);
  const Mat3 darm = -arm * t.seeds[k].A, dtheta = c * n * p.G;
  const Mat3 dbend = c * (dn * p.G + n * p.dG_dr);
  Mat6 strain = Mat6::Zero();
  strain.template block<3, 3>(0, 0) = c * dn * p.Rt;
  strain.template block<3, 3>(0, 3) = p.Rt * (dn * darm + p.l * dtheta);
  strain.template block<3, 3>(3, 3) = p.Rt * (dbend + p.bend * dtheta);
  if (!viscoelastic) return p.law.de * strain;

  const Mat3 dw = n * (p.G + c * p.dG_rp) - p.w_ref * dtheta;
  const Mat3 dvelocity = cross(u.w(k)) * darm - arm * t.seeds[k].B;
  Mat6 rate = Mat6::Zero();
  rate.template block<3, 3>(0, 0) = dn * p.Rt * (Mat3::Identity() - c * p.w);
  rate.template block<3, 3>(0, 3) =
      p.Rt * (dn * (dvelocity - p.w * darm) + p.l * dw + p.slope_rate * dtheta);
  rate.template block<3, 3>(3, 3) =
      p.Rt * (dn * p.G + c * n * p.dG_drp - p.w * dbend + p.bend * dw + p.bend_rate * dtheta);
  return p.law.de * strain + p.law.dep * rate;
}

/// Rows of the two nodes beside point a: load (F, M + (p − x) × F) and its opposite.
template <int Nodes>
void Beam<Nodes>::tangent(const Local<double>& u, Tangent& t) const {
  if (is_unloaded(u)) return;
  using Block = Eigen::Matrix<double, 3, 6>;
  for (int a = 0; a < points; ++a) {
    const PointTangent p = point_tangent(u, a);
    const Mat3 reach[2] = {cross<double>(p.s.p - u.x(a)), cross<double>(p.s.p - u.x(a + 1))};
    const auto add = [&](int column, const auto& dF, const auto& dM) {
      for (int side = 0; side < 2; ++side) {
        const double sign = side == 0 ? -1 : 1;  // the matrix is −∂r/∂δ
        const int row = t.row_node(a + side);
        add_rows(t, row, column, (sign * dF).eval());
        add_rows(t, row + 3, column, (sign * (dM + reach[side] * dF)).eval());
      }
    };
    for (int k = 0; k < Nodes; ++k) {
      const double n = BeamShape<Nodes>::n[a][k];
      const Mat3 dtheta = t.c * n * p.G;
      const Mat6 local = force_by_node(u, t, p, a, k);
      Block dF = p.s.R * local.template topRows<3>(), dM = p.s.R * local.template bottomRows<3>();
      dF.template rightCols<3>() -= p.F * dtheta;
      dM.template rightCols<3>() -= p.M * dtheta;
      dM.template leftCols<3>() -= t.c * n * p.F;  // δp × F
      dM.template rightCols<3>() += n * p.F * cross<double>(u.R(k) * offset[k]) * t.seeds[k].A;
      add(t.col_node(k), dF, dM);
    }
    t.block(t.row_node(a) + 3, t.col_node(a)) -= t.c * p.F;  // −δx × F
    t.block(t.row_node(a + 1) + 3, t.col_node(a + 1)) += t.c * p.F;
    for (int j = 0; j < static_cast<int>(actuators.size()); ++j) {
      const Vec6 local = t.c * point[a].actuation.col(j);
      add(t.col_scalar(j), Vec3(p.s.R * local.head<3>()), Vec3(p.s.R * local.tail<3>()));
    }
  }
}

template void Beam<2>::tangent(const Local<double>&, Tangent&) const;
template void Beam<3>::tangent(const Local<double>&, Tangent&) const;

}  // namespace mbcosim
