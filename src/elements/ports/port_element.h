/// Elements that are ports: external codes write their inputs and read their outputs.
#pragma once

#include <string>
#include <vector>

#include "elements/general_element.h"
#include "elements/ports/mapping_matrix.h"
#include "model/model.h"
#include "model/structural_port.h"

namespace mbcosim {

/// What a port element tells about itself. Inputs lie in State::memory.
struct ElementPort {
  enum class Kind {
    motion,  ///< in: imposed positions x (3) and orientations R by rows (9) of each node; out:
             ///< reactions (6 each)
    modal,  ///< in: force, moment on the modal node (6, when there is one), generalized forces (N);
            ///< out: q, q̇ (N each)
    mapped,  ///< in: loads of the points (6 each); the peer's points are x = H (points), its forces
             ///< come back by Hᵀ
    output   ///< out: values
  } kind = Kind::output;
  std::string name;  ///< by which peers find it
  bool from_deck = true;
  std::vector<int> nodes;                 ///< motion: imposed nodes; modal: the modal node or none
  bool positions_only = false;            ///< motion
  int modal_joint = 0;                    ///< modal: label of the joint; 0: none
  std::vector<int> mode_numbers;          ///< modal (N)
  std::vector<std::string> output_names;  ///< output: of each value
  int every = 1;                          ///< steps between exchanges that the deck asks for
  PortCoupling coupling = PortCoupling::loose;
  int memory = -1;  ///< offset of the inputs in State::memory
  int input_size = 0;
  int output_size = 0;
};

class PortElement {
 public:
  virtual ~PortElement() = default;
  virtual const ElementPort& port() const = 0;
  /// Appends the outputs.
  virtual void outputs(const GeneralView& u, std::vector<double>& out) const = 0;
  /// modal: equation of the first mode and unknown of its amplitude; −1: none.
  virtual int first_mode_row() const { return -1; }
  virtual int first_amplitude() const { return -1; }
  /// mapped: the points, and H (3 × peer's points, 3 × points).
  virtual const StructuralPort* points() const { return nullptr; }
  virtual const MappingMatrix* mapping() const { return nullptr; }
};

/// Where a port element stands.
struct PortElementRef {
  const PortElement* element = nullptr;
  const GeneralElementSet* set = nullptr;
  int index = 0;

  const ElementPort& port() const { return element->port(); }
  void outputs(const EvalContext& context, std::vector<double>& out) const {
    element->outputs(set->view(context, index), out);
  }
};

/// All of a model, in the order of the deck.
std::vector<PortElementRef> port_elements(const Model& model);
/// Is there a port of this name, of any kind?
bool has_port(const Model& model, const std::string& name);

/// Name of a variable of an element's port: "port.NAME.motion", "port.NAME.loads" (inputs),
/// "port.NAME.reactions", "port.NAME.modes", "port.NAME.values" (outputs). Empty: the kind has
/// none.
std::string port_input_name(const ElementPort& port);
std::string port_output_name(const ElementPort& port);

}  // namespace mbcosim
