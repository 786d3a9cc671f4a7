/// The readable and writable values of a model, by handle.
#pragma once

#include <span>
#include <string>
#include <unordered_map>
#include <vector>

#include "elements/ports/port_element.h"
#include "model/diagnostic.h"
#include "model/model.h"
#include "simulation/variable.h"

namespace mbcosim {

/// Built once per model; handles are indices into `list()`.
class Variables {
 public:
  explicit Variables(const Model& model);
  const std::vector<Variable>& list() const { return variables_; }
  int find(const std::string& name) const;
  void get(const EvalContext& context, int handle, std::vector<double>& out) const;
  Status set(const Model& model, State& state, int handle, std::span<const double> values) const;

 private:
  enum class Source {
    time,
    step,
    node_position,
    node_rotation,
    node_orientation,
    node_velocity,
    node_omega,
    node_acceleration,
    node_angular_acceleration,
    momentum,
    momenta_moment,
    node_load,
    scalar_value,
    scalar_rate,
    parameter,
    element_datum,
    element_arrow,
    drive,
    stream,
    port_loads,
    element_input,
    element_output
  };
  struct Entry {
    Source source;
    int index = 0;  ///< of the node, element, drive, stream or port
    int datum = 0;
  };
  void add(Variable v, Entry e);
  void add_structural(const Model& model, int node);
  void add_scalar(const Model& model, int node);
  void add_element(const Model& model, int element);
  void add_ports(const Model& model);

  std::vector<Variable> variables_;
  std::vector<Entry> entries_;
  std::vector<PortElementRef> ports_;  ///< elements that are ports
  std::unordered_map<std::string, int> index_;
};

}  // namespace mbcosim
