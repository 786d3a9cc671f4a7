/// Loads from an external code on points of structural nodes: `force: …, external structural`.
#pragma once

#include <vector>

#include "elements/general_element.h"
#include "model/structural_port.h"

namespace mbcosim {

/// Points k = 1…N fixed to structural nodes n at f_k (node frame), arm a_k = R_n f_k. The peer's
/// force F_k and moment M_k about the point, global components, are held in State::memory while the
/// equations are solved:
///
///   on node n              F_k,  M_k + a_k × F_k                           [N, N·m]
///   on the reference node  F₀ − Σ F_k,  M₀ − Σ (M_k + (x_k − x_r) × F_k)
///
/// The second line holds with `use reference node forces`, so that the peer then sends the total
/// load of the points as F₀, M₀ and their distribution as F_k, M_k. Source: MBDyn input manual,
/// structural forces, external.
class ExternalStructural : public GeneralElement {
 public:
  ExternalStructural(StructuralPort port, bool output_kinematics)
      : port_(std::move(port)), output_kinematics_(output_kinematics) {}

  void connect(GeneralConnection& c) override;
  void pattern(GeneralPattern& p) const override;
  void residual(const GeneralView& u, GeneralResidual& r) const override;
  void jacobian(const GeneralView& u, GeneralJacobian& j) const override;
  void output(const GeneralView& u, OutputRow& row) const override;

 private:
  struct Load {
    Vec3 f, m;  ///< global [N], about the point [N·m]
  };
  Load load(const GeneralView& u, int k) const;
  void load_reference(const GeneralView& u, GeneralResidual& r) const;
  void output_reference(const GeneralView& u, OutputRow& row) const;
  void output_motion(const GeneralView& u, OutputRow& row) const;

  StructuralPort port_;
  bool output_kinematics_;
  std::vector<int> rows_;   ///< first local row of each point's node
  int reference_row_ = -1;  ///< of the reference node, when it is loaded
};

}  // namespace mbcosim
