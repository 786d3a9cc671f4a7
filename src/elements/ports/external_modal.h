/// Generalized forces from an external code on the modes of a modal joint, and loads on its modal
/// node: `force: …, external modal`.
#pragma once

#include "elements/general_element.h"
#include "elements/modal/modal_joint.h"
#include "elements/ports/port_element.h"

namespace mbcosim {

/// With F, M (global components, moment about the node) and p held in State::memory:
///
///   modal node     force + F,  moment + M
///   mode j         + p_j
///
/// Source: MBDyn input manual, modal forces, external.
class ExternalModal : public GeneralElement, public PortElement {
 public:
  /// `joints` null: a rigid node alone.
  ExternalModal(ElementPort port, const ModalJointSet* joints, int joint)
      : port_(std::move(port)), joints_(joints), joint_(joint) {}
  const ElementPort& port() const override { return port_; }
  void outputs(const GeneralView& u, std::vector<double>& out) const override;
  int first_mode_row() const override { return joints_ ? joints_->first_mode_row(joint_) : -1; }
  int first_amplitude() const override { return joints_ ? joints_->first_own(joint_) : -1; }

  void connect(GeneralConnection& c) override;
  void pattern(GeneralPattern&) const override {}
  void other_rows(std::vector<int>& rows) const override;
  void residual(const GeneralView& u, GeneralResidual& r) const override;
  void jacobian(const GeneralView&, GeneralJacobian&) const override {}
  void output(const GeneralView& u, OutputRow& row) const override;

 private:
  bool has_node() const { return !port_.nodes.empty(); }
  const double* modal_forces(const State& state) const {
    return &state.memory[port_.memory + (has_node() ? 6 : 0)];
  }
  int modes() const { return static_cast<int>(port_.mode_numbers.size()); }

  ElementPort port_;
  const ModalJointSet* joints_;
  int joint_;
  int row_ = -1;  ///< first local row of the modal node
};

/// A port on a modal joint: on its modal node (if it has one and `rigid`) and its modes (if
/// `modal`).
ElementPort modal_port(const Model& model, const ModalJointSet& joints, int joint, bool rigid,
                       bool modal);

}  // namespace mbcosim
