/// A flexible body in its floating frame: active modes, invariants of the inertia, modal matrices.
///
/// With f_i the position of FEM node i, U_i and V_i its displacement and rotation shapes (3 × M),
/// m_i and J_i its lumped mass and inertia, × the skew matrix of a vector:
///
///   m = Σ m_i              S0 = Σ m_i f_i              J0 = Σ (J_i − m_i f_i× f_i×)
///   Inv3 = Σ m_i U_i       Inv4 = Σ (m_i f_i× U_i + J_i V_i)        Inv5_jk = Σ m_i U_ij × U_ik
///   Inv8_j = −Σ m_i f_i× U_ij×               Inv9_jk = Σ m_i U_ij× U_ik×
///   Inv10_j = Σ V_ij× J_i                    Inv11 = Σ J_i V_i
///
/// Source: MBDyn input manual, modal joint; Masarati, "MBDyn technical manual", modal joint.
#pragma once

#include <array>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "elements/modal/fem_data.h"
#include "math/types.h"

namespace mbcosim {

/// A square matrix that knows when it is diagonal: then only the diagonal is used in products.
struct ModalMatrix {
  MatX full;              ///< (M × M)
  bool diagonal = false;  ///< all other entries are zero

  explicit ModalMatrix(MatX m = MatX());
  /// r −= full · x
  template <class X, class R>
  void subtract_product(const X& x, R&& r) const {
    if (diagonal)
      r.array() -= full.diagonal().array() * x.array();
    else
      r.noalias() -= full * x;
  }
};

/// How the modal damping matrix C is made.
struct ModalDamping {
  enum class Kind { none, from_file, rayleigh, diagonal } kind = Kind::from_file;
  double mass_factor = 0;       ///< rayleigh: C = mass_factor · Mgen + stiffness_factor · Kgen
  double stiffness_factor = 0;  ///< [s]
  std::vector<double> ratios;   ///< diagonal: C_jj = 2 ξ_j √(K_jj M_jj) (M)
};

/// What a deck chooses of a FEM data file.
struct ModalSelection {
  std::vector<int> modes;  ///< numbers of the active modes in the file, from 1, ascending
  ModalDamping damping;
  double mass_threshold = 0, damping_threshold = 0,
         stiffness_threshold = 0;     ///< smaller entries become zero
  Vec3 origin = Vec3::Zero();         ///< origin of the floating frame in the FEM frame [m]
  bool second_order_inertia = false;  ///< Inv9
};

struct ModalBody {
  int modes = 0;                    ///< M
  std::vector<int> mode_numbers;    ///< in the file, from 1 (M)
  std::vector<std::string> labels;  ///< of the FEM nodes (N)
  MatX positions;                   ///< f_i (3 × N) [m]
  MatX shapes;                      ///< (6N × M), rows of a node: U_i, V_i
  ModalMatrix mass, stiffness, damping;
  VecX initial_amplitudes, initial_velocities;  ///< of the file (M)

  double m = 0;               ///< [kg]
  Vec3 S0 = Vec3::Zero();     ///< [kg·m]
  Mat3 J0 = Mat3::Zero();     ///< about the floating origin [kg·m²]
  bool detailed = false;      ///< group 11 was there: the invariants below exist
  bool second_order = false;  ///< inv9 exists
  MatX inv3, inv4, inv11;     ///< (3 × M)
  std::array<MatX, 3> inv5;   ///< component a of Inv5_jk at (j, k)
  MatX inv8, inv10;           ///< (9 × M), column j: the 3 × 3 matrix by columns
  std::array<MatX, 9> inv9;   ///< entry a + 3 b: component (a, b) of Inv9_jk at (j, k)

  int node_count() const { return static_cast<int>(labels.size()); }
  int find_node(std::string_view label) const;
  /// Position among the active modes, -1 when the mode is not active.
  int find_mode(int number) const;
  MatX displacement_shapes(int node) const { return shapes.middleRows(6 * node, 3); }
  MatX rotation_shapes(int node) const { return shapes.middleRows(6 * node + 3, 3); }

  /// First and second moments in the deformed shape q, floating axes: S0 + Inv3 q, J0 + A8 + A8ᵀ −
  /// A9.
  template <class Q>
  Vec3 first_moment(const Q& q) const {
    if (!detailed) return S0;
    Vec3 s = S0;
    s.noalias() += inv3 * q;
    return s;
  }
  template <class Q>
  Mat3 second_moment(const Q& q) const {
    if (!detailed) return J0;
    const Mat3 a8 = weighted(inv8, q);
    return J0 + a8 + a8.transpose() - weighted9(q, q);
  }
  /// Σ_j x_j (3 × 3 matrix j).
  template <class X>
  static Mat3 weighted(const MatX& by_columns, const X& x) {
    Mat3 r;
    Eigen::Map<VecN<9>>(r.data()).noalias() = by_columns * x;
    return r;
  }
  /// Σ_jk x_j y_k Inv9_jk; zero without second-order terms.
  template <class X, class Y>
  Mat3 weighted9(const X& x, const Y& y) const {
    Mat3 r = Mat3::Zero();
    if (!second_order) return r;
    for (int e = 0; e < 9; ++e)
      for (int k = 0; k < modes; ++k) r(e) += y(k) * inv9[e].col(k).dot(x);
    return r;
  }
  /// Σ_k x_k Inv9_jk; zero without second-order terms.
  template <class X>
  Mat3 inv9_row(int j, const X& x) const {
    Mat3 r = Mat3::Zero();
    if (!second_order) return r;
    for (int b = 0; b < 3; ++b)
      for (int a = 0; a < 3; ++a)
        r(a, b) = inv9[b + 3 * a].col(j).dot(x);  // Inv9_jk(a, b) = Inv9_kj(b, a)
    return r;
  }
  /// Inertia matrix at rest, order translation, rotation, modes (6+M square).
  MatX inertia_matrix() const;
};

/// Selects, thresholds, shifts and sums. `warnings` receives what is doubtful.
std::shared_ptr<const ModalBody> make_modal_body(const FemData& data,
                                                 const ModalSelection& selection,
                                                 std::vector<std::string>& warnings);

}  // namespace mbcosim
