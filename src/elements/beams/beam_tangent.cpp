// Closed-form linearization of beams.
#include "elements/beams/beam_section.h"
#include "math/rotation_derivative.h"

namespace mbcosim {

namespace {

template <class W>
using Mat66Of = Eigen::Matrix<W, 6, 6>;
template <class W>
using Mat63Of = Eigen::Matrix<W, 6, 3>;

template <class W>
Mat63Of<W> stacked(const Mat<W>& force, const Mat<W>& moment) {
  Mat63Of<W> m;
  m << force, moment;
  return m;
}

/// diag(R, R) K diag(R, R)ᵀ.
template <class W>
Mat66Of<W> rotated(const Mat<W>& R, const Mat66Of<W>& K) {
  Mat66Of<W> g;
  for (int i = 0; i < 6; i += 3)
    for (int j = 0; j < 6; j += 3)
      g.template block<3, 3>(i, j) = R * Mat<W>(K.template block<3, 3>(i, j)) * R.transpose();
  return g;
}

/// K (ε; κ), by blocks of three columns.
template <class W>
Mat63Of<W> product(const Mat66Of<W>& K, const Mat<W>& strain, const Mat<W>& curvature) {
  Mat63Of<W> f;
  for (int i = 0; i < 6; i += 3)
    f.template middleRows<3>(i) =
        K.template block<3, 3>(i, 0) * strain + K.template block<3, 3>(i, 3) * curvature;
  return f;
}

template <class W>
Mat63Of<W> product(const Mat66Of<W>& K, const Mat<W>& strain) {
  Mat63Of<W> f;
  for (int i = 0; i < 6; i += 3)
    f.template middleRows<3>(i) = K.template block<3, 3>(i, 0) * strain;
  return f;
}

}  // namespace

/// Derivatives of (F, M) at the evaluation points, global frame, with R a section's orientation,
/// K = ∂(F, M)/∂(ε, κ) and D = ∂(F, M)/∂(ε̇, κ̇) rotated to it, [a]× the skew matrix of a. A node
/// enters through its weights N and m N′ alone, so that all but its offset is computed once:
///
///   R δε = δl + [l]× δθ,   R δκ = δ(G r′) + [G r′]× δθ,   δθ = G δr
///   R δε̇ = δl̇ − [w]× δl + [l]× δw + [l̇ + l × w]× δθ,   R δκ̇ likewise from G ṙ′ + (G r′) × w
template <int Nodes>
struct Beam<Nodes>::PointTangent {
  using W = Wide<double>;
  Place<W> at;
  Section<W> s;
  Mat66Of<W> K, D;   ///< D: viscoelastic beams only
  Mat63Of<W> x_dn;   ///< by m N′ δx of a node
  Mat63Of<W> g_n;    ///< by N δg
  Mat63Of<W> g_dn;   ///< by m N′ δg
  Mat<W> F;          ///< [F]×
  Vec<W> f, moment;  ///< F and M, global, with the actuators' part
};

template <int Nodes>
auto Beam<Nodes>::point_tangent(const Local<double>& u, const Tangent& t,
                                const Line<Wide<double>>& along) const -> PointTangent {
  using W = Wide<double>;
  const double c = t.c;
  PointTangent p;
  p.s = section(u, along, 0);
  p.at = place<W>(0);
  std::array<Law<6>::Response, points> law;
  for (int a = 0; a < points; ++a) {
    point[a].law->respond(*u.context, lane(p.s.strain, a), lane(p.s.rate, a), true, law[a]);
    for (int j = 0; j < static_cast<int>(actuators.size()); ++j)
      law[a].f += u.scalar(j) * point[a].actuation.col(j);
  }
  const auto local = side_by_side<Eigen::Matrix<W, 6, 1>>([&](int a) { return law[a].f; });
  const bool with_rates = viscoelastic && u.context->phase != Phase::assembly;
  const Increment<W> i = increment(along.g, along.gp, with_rates, p.at);
  const Mat<W>& R = p.s.R;
  p.f = R * local.template head<3>();
  p.moment = R * local.template tail<3>();
  p.F = cross(p.f);
  p.K = rotated(R, side_by_side<Mat66Of<W>>([&](int a) -> const Mat6& { return law[a].de; }));

  const Mat<W> G = cgr_g(i.r), cG = c * G;
  const Vec<W> bend = G * i.dr;
  const Mat<W> l = cross(p.s.l), b = cross(bend), dG_dr = c * cgr_g_derivative(i.r, i.dr);
  p.x_dn = c * p.K.template leftCols<3>();
  p.g_n = product<W>(p.K, l * cG, dG_dr + b * cG) - stacked<W>(p.F * cG, cross(p.moment) * cG);
  p.g_dn = p.K.template rightCols<3>() * cG;
  if (viscoelastic)
    add_rate(u, t, i, side_by_side<Mat66Of<W>>([&](int a) -> const Mat6& { return law[a].dep; }),
             p);
  return p;
}

/// The dependence through the strain rates.
template <int Nodes>
void Beam<Nodes>::add_rate(const Local<double>& u, const Tangent& t,
                           const Increment<Wide<double>>& i,
                           const Eigen::Matrix<Wide<double>, 6, 6>& damping,
                           PointTangent& p) const {
  using W = Wide<double>;
  const double c = t.c;
  const Vec<W> w_ref = remembered<Vec<W>>(u, 0, &SectionHistory<const double>::w_ref);
  const Mat<W> G = cgr_g(i.r), cG = c * G, w = cross(p.s.w), l = cross(p.s.l);
  const Vec<W> bend = G * i.dr;
  const Mat<W> dw = G + c * cgr_g_derivative(i.r, i.rp) -
                    cross(Vec<W>(cgr_rotation(i.r) * w_ref)) * cG;               // δw by N δg
  const Mat<W> slope_rate = cross(Vec<W>(p.s.R * p.s.rate.template head<3>()));  // l̇ + l × w = R ε̇
  const Mat<W> bend_rate = cross(Vec<W>(G * i.drp + bend.cross(p.s.w)));
  p.D = rotated(p.s.R, damping);
  p.x_dn += product<W>(p.D, Mat<W>::Identity() - c * w);
  p.g_n += product<W>(p.D, l * dw + slope_rate * cG,
                      c * (cgr_g_derivative(i.r, i.drp) - w * cgr_g_derivative(i.r, i.dr)) +
                          cross(bend) * dw + bend_rate * cG);
  p.g_dn += p.D.template rightCols<3>() * (G - w * cG);
}

/// δ(F, M + δp × F) by the increments (x, g) of node k, global, 6 × 6.
template <int Nodes>
auto Beam<Nodes>::force_by_node(const Local<double>& u, const Tangent& t, const PointTangent& p,
                                int k) const -> Eigen::Matrix<Wide<double>, 6, 6> {
  using W = Wide<double>;
  const W n = p.at.n[k], dn = p.at.dn[k] * p.at.metric;
  Mat66Of<W> f;
  f.template leftCols<3>() = dn * p.x_dn;
  f.template rightCols<3>() = n * p.g_n + dn * p.g_dn;
  f.template block<3, 3>(3, 0) -= (t.c * n) * p.F;
  if (offset[k].isZero(0)) return f;
  const Mat3 lever = cross<double>(u.R(k) * offset[k]);
  const Mat<W> darm = Mat3(-lever * t.seeds[k].A).template cast<W>();
  f.template rightCols<3>() += product<W>(p.K, dn * darm);
  f.template block<3, 3>(3, 3) -= n * p.F * darm;
  if (!viscoelastic) return f;
  const Mat<W> spin = Mat3(cross(u.w(k))).template cast<W>() - cross(p.s.w),
               turn = Mat3(lever * t.seeds[k].B).template cast<W>();
  f.template rightCols<3>() += product<W>(p.D, dn * (spin * darm - turn));
  return f;
}

/// Rows of the two nodes beside each point: load (F, M + (p − x) × F) and its opposite. A beam that
/// has not been loaded yet is stiff nonetheless: modes about the initial state need it.
template <int Nodes>
void Beam<Nodes>::tangent(const Local<double>& u, Tangent& t) const {
  using W = Wide<double>;
  const PointTangent p = point_tangent(u, t, line(u));
  const Vec<W> reach[2] = {p.s.p - position(u, 0), p.s.p - position(u, 1)};
  const auto add = [&](int column, const Vec<W>& f, const Vec<W>& m) {
    for (int side = 0; side < 2; ++side) {
      const double sign = side == 0 ? -1 : 1;  // the matrix is −∂r/∂δ
      const Vec<W> moment = m + reach[side].cross(f);
      for (int a = 0; a < points; ++a) {
        double* const rows = &t.at(t.row_node(a + side), column);
        for (int i = 0; i < 3; ++i) {
          rows[i] += sign * lane(f(i), a);
          rows[3 + i] += sign * lane(moment(i), a);
        }
      }
    }
  };
  for (int k = 0; k < Nodes; ++k) {
    const Mat66Of<W> f = force_by_node(u, t, p, k);
    for (int j = 0; j < 6; ++j)
      add(t.col_node(k) + j, f.col(j).template head<3>(), f.col(j).template tail<3>());
  }
  for (int a = 0; a < points; ++a) {
    const Mat3 F = t.c * Mat3(lane(p.F, a));
    t.block(t.row_node(a) + 3, t.col_node(a)) -= F;  // −δx × F
    t.block(t.row_node(a + 1) + 3, t.col_node(a + 1)) += F;
  }
  for (int j = 0; j < static_cast<int>(actuators.size()); ++j) {
    const auto local = side_by_side<Eigen::Matrix<W, 6, 1>>(
        [&](int a) { return Vec6(t.c * point[a].actuation.col(j)); });
    const Vec<W> force = local.template head<3>(), moment = local.template tail<3>();
    add(t.col_scalar(j), p.s.R * force, p.s.R * moment);
  }
}

template void Beam<2>::tangent(const Local<double>&, Tangent&) const;
template void Beam<3>::tangent(const Local<double>&, Tangent&) const;

}  // namespace mbcosim
