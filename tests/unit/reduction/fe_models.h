/// Finite element models of chains, beams and plates, small enough to know their answers.
#pragma once

#include <Eigen/Dense>
#include <string>
#include <vector>

#include "reduction/fe_model.h"

namespace mbcosim {

using Triplets = std::vector<Eigen::Triplet<double>>;

inline SparseMatrix assembled(int order, const Triplets& entries) {
  SparseMatrix m(order, order);
  m.setFromTriplets(entries.begin(), entries.end());
  return m;
}

inline void add_block(Triplets& entries, const std::vector<int>& rows, const MatX& block) {
  for (std::size_t i = 0; i < rows.size(); ++i)
    for (std::size_t j = 0; j < rows.size(); ++j)
      if (block(i, j) != 0) entries.emplace_back(rows[i], rows[j], block(i, j));
}

inline std::vector<std::string> numbered(int count) {
  std::vector<std::string> labels;
  for (int k = 1; k <= count; ++k) labels.push_back(std::to_string(k));
  return labels;
}

/// Masses 1 and springs 100 along x, one row each; `ground`: spring from mass 1 to the ground.
inline FeModel spring_chain(int masses, double ground = 0) {
  Triplets k, m;
  MatX positions = MatX::Zero(3, masses);
  std::vector<FeDof> dofs;
  for (int i = 0; i < masses; ++i) {
    positions(0, i) = i;
    dofs.push_back({i, 0});
    m.emplace_back(i, i, 1.0);
    if (i + 1 < masses) add_block(k, {i, i + 1}, (MatX(2, 2) << 100, -100, -100, 100).finished());
  }
  if (ground > 0) k.emplace_back(0, 0, ground);
  return make_fe_model(numbered(masses), positions, dofs, assembled(masses, m),
                       assembled(masses, k));
}

/// Bending stiffness of a beam element, displacements and slopes (w₁, θ₁, w₂, θ₂), θ = dw/dx.
inline MatX beam_stiffness(double ei, double h) {
  MatX k(4, 4);
  k << 12, 6 * h, -12, 6 * h, 6 * h, 4 * h * h, -6 * h, 2 * h * h, -12, -6 * h, 12, -6 * h, 6 * h,
      2 * h * h, -6 * h, 4 * h * h;
  return ei / (h * h * h) * k;
}
inline MatX beam_mass(double m, double h) {
  MatX k(4, 4);
  k << 156, 22 * h, 54, -13 * h, 22 * h, 4 * h * h, 13 * h, -3 * h * h, 54, 13 * h, 156, -22 * h,
      -13 * h, -3 * h * h, -22 * h, 4 * h * h;
  return m * h / 420 * k;
}

/// Euler-Bernoulli beam in the plane x-y, L = EI = ρA = 1, consistent mass: rows uy, rz of each
/// node.
inline FeModel planar_beam(int elements) {
  const double h = 1.0 / elements;
  Triplets k, m;
  MatX positions = MatX::Zero(3, elements + 1);
  std::vector<FeDof> dofs;
  for (int n = 0; n <= elements; ++n) {
    positions(0, n) = n * h;
    dofs.push_back({n, 1});
    dofs.push_back({n, 5});
  }
  for (int e = 0; e < elements; ++e) {
    const std::vector<int> rows = {2 * e, 2 * e + 1, 2 * e + 2, 2 * e + 3};
    add_block(k, rows, beam_stiffness(1, h));
    add_block(m, rows, beam_mass(1, h));
  }
  const int order = 2 * (elements + 1);
  return make_fe_model(numbered(elements + 1), positions, dofs, assembled(order, m),
                       assembled(order, k));
}

/// Beam along x from -1 to 1 m, 9 nodes of 6 rows: EA = 1e5, GJ, EI_y = 100, EI_z = 150; mass 1.5
/// kg/m and rotary inertia lumped at the element ends.
inline FeModel space_beam(double gj = 80) {
  constexpr int kElements = 8;
  constexpr double h = 2.0 / kElements;
  Triplets k, m;
  MatX positions = MatX::Zero(3, kElements + 1);
  for (int n = 0; n <= kElements; ++n) positions(0, n) = -1 + n * h;
  const auto rod = [](double c) { return (MatX(2, 2) << c, -c, -c, c).finished(); };
  for (int e = 0; e < kElements; ++e) {
    const int a = 6 * e, b = a + 6;
    add_block(k, {a, b}, rod(1e5 / h));
    add_block(k, {a + 3, b + 3}, rod(gj / h));
    add_block(k, {a + 1, a + 5, b + 1, b + 5}, beam_stiffness(150, h));
    const VecX flip = (VecX(4) << 1, -1, 1, -1).finished();  // rotation about y is -dw/dx
    add_block(k, {a + 2, a + 4, b + 2, b + 4},
              flip.asDiagonal() * beam_stiffness(100, h) * flip.asDiagonal());
    for (const int end : {a, b}) {
      for (int c = 0; c < 3; ++c) m.emplace_back(end + c, end + c, 1.5 * h / 2);
      m.emplace_back(end + 3, end + 3, 0.02 * h / 2);
      for (int c = 4; c < 6; ++c) m.emplace_back(end + c, end + c, 1.5 * h * h * h / 78);
    }
  }
  const int order = 6 * (kElements + 1);
  return make_fe_model(numbered(kElements + 1), positions, {}, assembled(order, m),
                       assembled(order, k));
}

/// Rectangular plate bending element of 12 terms (Adini, Clough, Melosh): rows uz, rx, ry of the
/// corners (0,0), (a,0), (a,b), (0,b); stiffness D, Poisson's ratio ν, mass per area 1.
struct PlateElement {
  MatX stiffness = MatX::Zero(12, 12), mass = MatX::Zero(12, 12);

  PlateElement(double a, double b, double d, double nu) {
    MatX corners(12, 12);
    const double x[] = {0, a, a, 0}, y[] = {0, 0, b, b};
    for (int n = 0; n < 4; ++n) {
      corners.row(3 * n) = terms(x[n], y[n], 0, 0);
      corners.row(3 * n + 1) = terms(x[n], y[n], 0, 1);   // rx =  dw/dy
      corners.row(3 * n + 2) = -terms(x[n], y[n], 1, 0);  // ry = -dw/dx
    }
    const MatX coefficients = corners.inverse();
    Mat3 law;
    law << d, nu * d, 0, nu * d, d, 0, 0, 0, 0.5 * (1 - nu) * d;
    const double p[] = {-0.8611363115940526, -0.3399810435848563, 0.3399810435848563,
                        0.8611363115940526};
    const double w[] = {0.3478548451374538, 0.6521451548625461, 0.6521451548625461,
                        0.3478548451374538};
    for (int i = 0; i < 4; ++i)
      for (int j = 0; j < 4; ++j) {
        const double px = a / 2 * (1 + p[i]), py = b / 2 * (1 + p[j]),
                     area = w[i] * w[j] * a * b / 4;
        MatX curvature(3, 12);
        curvature << terms(px, py, 2, 0), terms(px, py, 0, 2), 2 * terms(px, py, 1, 1);
        const MatX strain = curvature * coefficients, shape = terms(px, py, 0, 0) * coefficients;
        stiffness += area * strain.transpose() * law * strain;
        mass += area * shape.transpose() * shape;
      }
  }

  /// Derivatives of the 12 terms: dx times along x, dy along y.
  static Eigen::RowVectorXd terms(double x, double y, int dx, int dy) {
    static constexpr int kPowers[12][2] = {{0, 0}, {1, 0}, {0, 1}, {2, 0}, {1, 1}, {0, 2},
                                           {3, 0}, {2, 1}, {1, 2}, {0, 3}, {3, 1}, {1, 3}};
    const auto power = [](double v, int n, int derivatives) {
      double factor = 1;
      for (int k = 0; k < derivatives; ++k) factor *= n - k;
      return factor == 0 ? 0 : factor * std::pow(v, n - derivatives);
    };
    Eigen::RowVectorXd row(12);
    for (int t = 0; t < 12; ++t) row(t) = power(x, kPowers[t][0], dx) * power(y, kPowers[t][1], dy);
    return row;
  }
};

/// Plate a × b in the plane x-y, D = 1, mass 1 per area, nx × ny elements; rows uz, rx, ry.
inline FeModel plate(double a, double b, int nx, int ny, bool simply_supported) {
  const PlateElement element(a / nx, b / ny, 1, 0.3);
  Triplets k, m;
  const int nodes = (nx + 1) * (ny + 1);
  MatX positions = MatX::Zero(3, nodes);
  std::vector<FeDof> dofs;
  for (int n = 0; n < nodes; ++n) {
    positions.col(n) << n % (nx + 1) * a / nx, n / (nx + 1) * b / ny, 0;
    for (const int c : {2, 3, 4}) dofs.push_back({n, c});
  }
  for (int j = 0; j < ny; ++j)
    for (int i = 0; i < nx; ++i) {
      std::vector<int> rows;
      const int corner = j * (nx + 1) + i;
      for (const int n : {corner, corner + 1, corner + nx + 2, corner + nx + 1})
        for (int c = 0; c < 3; ++c) rows.push_back(3 * n + c);
      add_block(k, rows, element.stiffness);
      add_block(m, rows, element.mass);
    }
  FeModel model = make_fe_model(numbered(nodes), positions, dofs, assembled(3 * nodes, m),
                                assembled(3 * nodes, k));
  for (int n = 0; n < nodes && simply_supported; ++n) {
    const int i = n % (nx + 1), j = n / (nx + 1);
    if (i == 0 || i == nx || j == 0 || j == ny) model.supported[3 * n] = 1;
  }
  return model;
}

}  // namespace mbcosim
