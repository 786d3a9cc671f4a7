/// Values that a deck sends to an external code: `stream output`, `stream motion output`.
#pragma once

#include "elements/general_element.h"
#include "elements/ports/port_element.h"
#include "model/drive.h"

namespace mbcosim {

/// One number after the other: dofs of nodes, drives, and the motion of structural nodes. Adds
/// nothing to the equations. Source: MBDyn input manual, output elements.
class StreamOutput : public GeneralElement, public PortElement {
 public:
  struct Value {
    NodeDof dof;     ///< of a node, or
    DrivePtr drive;  ///< a drive
  };
  enum class Motion { position, orientation, transposed_orientation, velocity, angular_velocity };

  /// `log`: line of the .log; empty: none.
  StreamOutput(ElementPort port, std::vector<Value> values, std::vector<Motion> motion,
               std::vector<int> nodes, std::string log)
      : port_(std::move(port)),
        values_(std::move(values)),
        motion_(std::move(motion)),
        nodes_(std::move(nodes)),
        log_(std::move(log)) {}
  const ElementPort& port() const override { return port_; }
  void outputs(const GeneralView& u, std::vector<double>& out) const override;

  void connect(GeneralConnection&) override {}
  void pattern(GeneralPattern&) const override {}
  void residual(const GeneralView&, GeneralResidual&) const override {}
  void jacobian(const GeneralView&, GeneralJacobian&) const override {}
  std::string log(const Model&, int) const override { return log_; }

 private:
  ElementPort port_;
  std::vector<Value> values_;
  std::vector<Motion> motion_;  ///< of each node, in this order
  std::vector<int> nodes_;
  std::string log_;
};

}  // namespace mbcosim
