#include "elements/ports/external_modal.h"

namespace mbcosim {

ElementPort modal_port(const Model&, const ModalJointSet& joints, int joint, bool rigid,
                       bool modal) {
  const ModalJoint& j = joints.joint(joint);
  ElementPort port;
  port.kind = ElementPort::Kind::modal;
  port.modal_joint = joints.info(joint).label;
  if (rigid && j.node >= 0) port.nodes.push_back(j.node);
  if (modal) port.mode_numbers = j.body->mode_numbers;
  const int modes = static_cast<int>(port.mode_numbers.size());
  port.input_size = 6 * static_cast<int>(port.nodes.size()) + modes;
  port.output_size = 2 * modes;
  return port;
}

void ExternalModal::connect(GeneralConnection& c) {
  if (has_node()) row_ = c.node(port_.nodes.front());
}

void ExternalModal::other_rows(std::vector<int>& rows) const {
  for (int k = 0; k < modes(); ++k) rows.push_back(first_mode_row() + k);
}

void ExternalModal::residual(const GeneralView& u, GeneralResidual& r) const {
  if (has_node()) {
    const double* load = &u.state().memory[port_.memory];
    for (int i = 0; i < 6; ++i) r.add(row_ + i, load[i]);
  }
  const double* p = modal_forces(u.state());
  for (int k = 0; k < modes(); ++k) r.add_to_equation(first_mode_row() + k, p[k]);
}

void ExternalModal::outputs(const GeneralView& u, std::vector<double>& out) const {
  if (modes() == 0) return;
  const ModalUnknowns m = joints_->unknowns(u.context, joint_);
  out.insert(out.end(), m.q.data(), m.q.data() + m.q.size());
  out.insert(out.end(), m.p.data(), m.p.data() + m.p.size());
}

void ExternalModal::output(const GeneralView& u, OutputRow& row) const {
  const std::string label = std::to_string(u.label());
  if (has_node()) {
    const double* load = &u.state().memory[port_.memory];
    row.begin_text(OutputFile::frc,
                   label + "#" + std::to_string(u.model().structural[port_.nodes.front()].label));
    row.vec3("F", "N", Vec3(load[0], load[1], load[2]));
    row.vec3("M", "N m", Vec3(load[3], load[4], load[5]));
    row.end();
  }
  const double* p = modal_forces(u.state());
  for (int k = 0; k < modes(); ++k) {
    row.begin_text(OutputFile::frc, label + "." + std::to_string(port_.mode_numbers[k]));
    row.scalar("f", "", p[k]);
    row.end();
  }
}

}  // namespace mbcosim
