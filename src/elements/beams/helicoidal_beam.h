/// Two-node beam interpolated along a screw (`hbeam`).
#pragma once

#include "elements/element.h"
#include "model/law.h"

namespace mbcosim {

/// Helicoidal beam: one section at its middle, elastic. With ends at p₁, p₂ of orientation R₁, R₂
/// (Borri and Bottasso, "An intrinsic beam model based on a helicoidal approximation", Int. J.
/// Numer. Meth. Eng. 37, 1994):
///
///   φ = vec(R₂ R₁ᵀ),  ρ = Γ(φ)⁻¹ (p₂ − exp(φ×) p₁)
///   R = exp(φ×/2) R₁,  p = exp(φ×/2) p₁ + Γ(φ/2) ρ/2        middle section
///   t = (ρ + φ × p)/ℓ,  κ = φ/ℓ,  ℓ = |ρ + φ × p| as read
///   strain = Rᵀ (t, κ) minus its value as read;  (F, M) = law(strain)   section frame [N, N·m]
///
/// Γ(φ) = ∫₀¹ exp(s φ×) ds. Loads on the nodes as those of beam2: RF at p on node 1, reversed on
/// node 2.
struct HelicoidalBeam {
  int node[2] = {-1, -1};
  Vec3 offset[2] = {Vec3::Zero(), Vec3::Zero()};            ///< of the ends, node frames [m]
  Mat3 relative[2] = {Mat3::Identity(), Mat3::Identity()};  ///< end frame -> node
  LawPtr<6> law;
  double length = 1;           ///< ℓ [m]
  Vec6 origin = Vec6::Zero();  ///< Rᵀ (t, κ) as read

  static constexpr int width = 12;
  static constexpr AssemblyRole assembly = AssemblyRole::elastic;

  void connect(Connector& c) const {
    for (const int n : node) c.distinct_node(n);
    c.memory(1);  // has it been loaded?
  }

  template <class T>
  struct Section {
    Vec<T> p;
    Mat<T> R;
    Eigen::Matrix<T, 6, 1> bend;  ///< Rᵀ (ρ + φ × p, φ) [m, rad]
  };
  template <class T>
  static Section<T> section(const Vec<T> (&p)[2], const Mat<T> (&R)[2]);
  template <class T>
  Section<T> section(const Local<T>& u) const {
    const Vec<T> p[2] = {u.x(0) + u.R(0) * offset[0].cast<T>(),
                         u.x(1) + u.R(1) * offset[1].cast<T>()};
    const Mat<T> R[2] = {u.R(0) * relative[0].cast<T>(), u.R(1) * relative[1].cast<T>()};
    return section(p, R);
  }
  template <class T>
  Eigen::Matrix<T, 6, 1> internal_force(const Local<T>& u, const Section<T>& s) const {
    Eigen::Matrix<T, 6, 1> strain, rate;
    for (int i = 0; i < 6; ++i) {
      strain(i) = s.bend(i) * (1 / length) - origin(i);
      rate(i) = T(0.0);
    }
    return law->template force<T>(*u.context, strain, rate);
  }
  template <class T>
  void residual(const Local<T>& u, Residual<T>& r) const {
    if (is_unloaded(u)) return;
    const Section<T> s = section(u);
    const Eigen::Matrix<T, 6, 1> local = internal_force(u, s);
    const Vec<T> f = s.R * Vec<T>(local.template head<3>());
    const Vec<T> m = s.R * Vec<T>(local.template tail<3>());
    r.load(0, f, m + Vec<T>(s.p - u.x(0)).cross(f));
    r.load(1, -f, -m - Vec<T>(s.p - u.x(1)).cross(f));
  }

  /// Takes the nodes as they were read for ℓ and the origin of the strains.
  void set_geometry(const Model& model);
  void start(Start& s) const;
  void at_derivatives(const Local<double>& u, State& state, bool first) const {
    if (!first) state.memory[u.memory_offset()] = 1;
  }
  void after_predict(const Local<double>& u, State& state) const;
  void output(const Local<double>& u, OutputRow& row) const;
  std::string log(const Model& model, int label) const;

 private:
  /// As beams: without an initial assembly the internal forces are zero until the first prediction.
  template <class T>
  bool is_unloaded(const Local<T>& u) const {
    return u.context->phase != Phase::assembly && u.memory(0) == 0;
  }
};

void read_helicoidal_beam(Card& card, ElementInfo& info);

}  // namespace mbcosim
