/// Generalized forces from an external code on modes that nodes of the model follow by a matrix:
/// `force: …, external modal mapping`.
#pragma once

#include "elements/general_element.h"
#include "elements/ports/port_element.h"

namespace mbcosim {

/// Nodes i = 1…n with X₀, R₀ at input, relative to the reference node r when there is one (then
/// x, R, v, w below are relative to it, in its frame):
///
///   ξ_i = (x_i − X₀ ; ax(R_i R₀ᵀ))   ξ̇_i = (v_i ; w_i)     q = H ξ,  q̇ = H ξ̇   (m modes)
///
/// with ax A the axial vector of the skew part of A. The peer's p acts as f = Hᵀ p on the nodes
/// (force, moment about the node; turned by R_r), its F₀, M₀ on the reference node:
///
///   on node i   f_i, m_i
///   on node r   F₁ − Σ f_i,  M₁ − Σ (m_i + (x_i − x_r) × f_i)      when rigid loads travel
///
/// F₁, M₁ are F₀, M₀ turned by R_r (or not: `rotate rigid body forces, no`; 0 when not used). So
/// virtual work is kept. Source: MBDyn input manual, forces, external modal mapping.
class MappedModal : public GeneralElement, public PortElement {
 public:
  struct Settings {
    std::vector<int> nodes;          ///< structural node indices (n)
    int reference = -1;              ///< structural node; −1: none
    bool use_rigid_loads = true;     ///< F₁ = F₀
    bool rotate_rigid_loads = true;  ///< F₀, M₀ come in the frame of r
    MappingMatrix H;                 ///< (m × 6n)
  };
  /// `input`: the state at input.
  MappedModal(ElementPort port, Settings settings, const Model& model, const EvalContext& input);
  const ElementPort& port() const override { return port_; }
  void outputs(const GeneralView& u, std::vector<double>& out) const override;

  void connect(GeneralConnection& c) override;
  void pattern(GeneralPattern& p) const override;
  void residual(const GeneralView& u, GeneralResidual& r) const override;
  void jacobian(const GeneralView& u, GeneralJacobian& j) const override;
  void output(const GeneralView& u, OutputRow& row) const override;

 private:
  struct Load {
    Vec3 f, m;  ///< global, about the node [N], [N·m]
  };
  struct Motion {
    VecX xi, xi_rate;  ///< (6n)
  };
  bool is_rigid() const { return !port_.nodes.empty(); }
  int modes() const { return static_cast<int>(settings_.H.rows()); }
  const double* modal_forces(const State& state) const;
  NodeState relative(const Model& model, const EvalContext& context, int k) const;
  Motion motion(const GeneralView& u) const;
  std::vector<Load> loads(const GeneralView& u) const;
  Load sum(const GeneralView& u, const std::vector<Load>& loads) const;
  Load rigid_load(const GeneralView& u) const;
  void output_reference(const GeneralView& u, const std::vector<Load>& loads, OutputRow& row) const;

  ElementPort port_;
  Settings settings_;
  std::vector<Vec3> x0_;  ///< X₀ (n)
  std::vector<Mat3> R0_;  ///< R₀ (n)
  std::vector<int> rows_;
  int reference_row_ = -1;
};

}  // namespace mbcosim
