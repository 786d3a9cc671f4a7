#include "elements/ports/attach.h"

#include <algorithm>

#include "elements/ports/external_modal.h"
#include "elements/ports/imposed_motion.h"

namespace mbcosim {

namespace {

Error refusal(const PortAttachment& a, const std::string& text) {
  return make_error(ErrorKind::argument, "BAD_PORT", "port \"" + a.name + "\": " + text);
}

/// Labels of attached elements are negative: no card has them.
ElementInfo info_of(const Model& model, const PortAttachment& a, Family family, const char* type) {
  ElementInfo info;
  info.family = family;
  info.label = -1 - static_cast<int>(model.elements.size());
  info.type = type;
  info.name = a.name;
  info.output = false;
  info.order = static_cast<int>(model.elements.size());
  return info;
}

Status attach_motion(ModelBuilder& builder, const PortAttachment& a) {
  const Model& model = builder.model();
  ElementPort port;
  port.kind = ElementPort::Kind::motion;
  port.name = a.name;
  port.from_deck = false;
  port.positions_only = a.positions_only;
  if (a.node_labels.empty()) return refusal(a, "it has no nodes");
  for (const int label : a.node_labels) {
    const int node = model.find_structural(label);
    if (node < 0) return refusal(a, "there is no structural node " + std::to_string(label));
    const StructuralNode& n = model.structural[node];
    if (n.is_dummy())
      return refusal(
          a, "no motion can be imposed on " + model.node_text(node) + ", which is a dummy node");
    if (!n.has_rotation() && !a.positions_only)
      return refusal(a, model.node_text(node) + " has no orientation; impose positions only");
    if (std::find(port.nodes.begin(), port.nodes.end(), node) != port.nodes.end())
      return refusal(a, model.node_text(node) + " is listed twice");
    port.nodes.push_back(node);
  }
  const int n = static_cast<int>(port.nodes.size());
  port.input_size = ImposedMotion::kInputs * n;
  port.output_size = 6 * n;
  port.memory = builder.allocate_memory(port.input_size);
  const ElementInfo info = info_of(model, a, Family::joint, "imposed motion");
  add_general_element(builder, info, std::make_unique<ImposedMotion>(std::move(port)));
  return ok();
}

Status attach_modal(ModelBuilder& builder, const PortAttachment& a) {
  const Model& model = builder.model();
  const ElementRef ref = model.find_element(Family::joint, a.modal_joint);
  const auto* joints = dynamic_cast<const ModalJointSet*>(ref.set);
  if (!joints) return refusal(a, "there is no modal joint " + std::to_string(a.modal_joint));
  ElementPort port = modal_port(model, *joints, ref.index, true, true);
  port.name = a.name;
  port.from_deck = false;
  port.memory = builder.allocate_memory(port.input_size);
  const ElementInfo info = info_of(model, a, Family::force, "external modal");
  add_general_element(builder, info,
                      std::make_unique<ExternalModal>(std::move(port), joints, ref.index));
  return ok();
}

}  // namespace

Status attach_port(ModelBuilder& builder, const PortAttachment& attachment) {
  if (attachment.name.empty()) return refusal(attachment, "a port must have a name");
  if (has_port(builder.model(), attachment.name))
    return refusal(attachment, "there is a port of this name already");
  return attachment.kind == ElementPort::Kind::modal ? attach_modal(builder, attachment)
                                                     : attach_motion(builder, attachment);
}

}  // namespace mbcosim
