/// Functions of the namespace `model` and plugin variables: values of nodes, elements and drives
/// (MBDyn input manual, "numeric values", namespaces and plugin variables).
#pragma once

#include <string>
#include <string_view>

#include "model/element_set.h"
#include "model/fwd.h"

namespace mbcosim {

/// A function of one or two nodes: `position(n)`, `yvrel_prev(a, b)`, ...
struct NodeFunction {
  enum class Quantity {
    position,
    distance,
    unit_vector,
    angle,
    angle_relative,
    velocity,
    velocity_relative,
    angular_velocity,
    angular_velocity_relative
  };
  enum class Part { norm, square, x, y, z };
  Quantity quantity = Quantity::position;
  Part part = Part::norm;
  bool previous = false;  ///< values of the last completed step

  int nodes() const;  ///< number of labels
  int code() const {
    return (static_cast<int>(quantity) * 5 + static_cast<int>(part)) * 2 + previous;
  }
  static NodeFunction from_code(int code);
};

/// False when there is no such function.
bool find_node_function(std::string_view name, NodeFunction* function);
std::string nearest_model_function(std::string_view name);

/// All of these throw EvaluationError.
double evaluate(const NodeFunction& function, const EvalContext& context, int label_a, int label_b);
double evaluate_drive(const EvalContext& context, int label, double argument, bool derivative);

/// What `model::node::TYPE` and plugin variables call a kind of node: 0 structural, 1 + ScalarKind
/// otherwise; -1 unknown.
int node_type(std::string_view word);

/// A private datum of a node or element as a drive. `datum` may be empty when the entity has
/// exactly one, or its number
/// (`index` ≥ 1) may be given instead. Throws EvaluationError when entity or datum do not exist.
DrivePtr node_datum(const Model& model, int type, int label, std::string_view datum, int index = 0);
/// `datum`: its number as `ElementSet::private_datum` gives it.
DrivePtr element_datum(ElementRef element, int datum);
DrivePtr element_datum(const Model& model, Family family, bool has_label, int label,
                       std::string_view datum, int index = 0);
/// Value (order 0) or rate (1) of a degree of freedom; `component` counts from 1, 0: the only one.
DrivePtr dof_value(const Model& model, int type, int label, int component, int order,
                   bool previous);

}  // namespace mbcosim
