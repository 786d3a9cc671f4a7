/// Motion of structural nodes that an external code imposes.
#pragma once

#include "elements/general_element.h"
#include "elements/ports/port_element.h"

namespace mbcosim {

/// Nodes k follow positions x̄_k and orientations R̄_k, global frame, which are held in
/// State::memory. λ_k [N] and μ_k [N·m] are the force and the moment that the model exerts on the
/// external side:
///
///   on node k     −λ_k,  −μ_k
///   constraint    (x_k − x̄_k)/c = 0,   ax(R_k R̄_kᵀ)/c = 0
///
/// with ax A the axial vector of the skew part of A. Until something is written, the nodes stay
/// where the initial assembly left them. Takes no part in the assembly.
class ImposedMotion : public GeneralElement, public PortElement {
 public:
  static constexpr int kInputs = 12;  ///< x̄ (3), R̄ by rows (9)

  explicit ImposedMotion(ElementPort port) : port_(std::move(port)) {}
  const ElementPort& port() const override { return port_; }
  /// λ and μ of each node (6 each).
  void outputs(const GeneralView& u, std::vector<double>& out) const override;

  void connect(GeneralConnection& c) override;
  void pattern(GeneralPattern& p) const override;
  void residual(const GeneralView& u, GeneralResidual& r) const override;
  void jacobian(const GeneralView& u, GeneralJacobian& j) const override;
  void start(const GeneralView& u, State& state) const override;
  std::string row_name(int own) const override;

 private:
  struct Target {
    Vec3 x;
    Mat3 R;
  };
  Target target(const State& state, int k) const;
  int rows_of_node() const { return port_.positions_only ? 3 : 6; }

  ElementPort port_;
  std::vector<int> rows_;  ///< first local row of each node
  int own_ = 0;            ///< first local number of the multipliers
};

}  // namespace mbcosim
