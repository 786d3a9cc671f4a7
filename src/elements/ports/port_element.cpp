#include "elements/ports/port_element.h"

#include <algorithm>

namespace mbcosim {

std::vector<PortElementRef> port_elements(const Model& model) {
  std::vector<PortElementRef> found;
  for (const ElementRef& e : model.elements)
    if (const auto* set = dynamic_cast<const GeneralElementSet*>(e.set))
      if (const auto* port = dynamic_cast<const PortElement*>(&set->element(e.index)))
        found.push_back({port, set, e.index});
  return found;
}

bool has_port(const Model& model, const std::string& name) {
  const auto named = [&](const auto& port) { return port.name == name; };
  if (std::any_of(model.structural_ports.begin(), model.structural_ports.end(), named)) return true;
  const std::vector<PortElementRef> elements = port_elements(model);
  return std::any_of(elements.begin(), elements.end(),
                     [&](const PortElementRef& e) { return named(e.port()); });
}

std::string port_input_name(const ElementPort& port) {
  if (port.input_size == 0) return "";
  return "port." + port.name + (port.kind == ElementPort::Kind::motion ? ".motion" : ".loads");
}

std::string port_output_name(const ElementPort& port) {
  if (port.output_size == 0) return "";
  const char* const what = port.kind == ElementPort::Kind::motion  ? ".reactions"
                           : port.kind == ElementPort::Kind::modal ? ".modes"
                                                                   : ".values";
  return "port." + port.name + what;
}

}  // namespace mbcosim
