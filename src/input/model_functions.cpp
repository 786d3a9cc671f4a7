#include "input/model_functions.h"

#include <algorithm>
#include <vector>

#include "input/nearest.h"
#include "math/rotation.h"
#include "model/diagnostic.h"
#include "model/drive.h"
#include "model/model.h"
#include "model/nested_evaluation.h"
#include "model/registry.h"

namespace mbcosim {

namespace {

using Quantity = NodeFunction::Quantity;
using Part = NodeFunction::Part;

[[noreturn]] void fail(const std::string& message) { throw EvaluationError(message); }

struct QuantityName {
  const char* name;
  Quantity quantity;
  bool whole;  ///< norm and square exist
};
constexpr QuantityName kQuantities[] = {
    {"position", Quantity::position, true},
    {"distance", Quantity::distance, true},
    {"unitvec", Quantity::unit_vector, false},
    {"angle", Quantity::angle, true},
    {"anglerel", Quantity::angle_relative, true},
    {"velocity", Quantity::velocity, true},
    {"vrel", Quantity::velocity_relative, true},
    {"angvel", Quantity::angular_velocity, true},
    {"angvrel", Quantity::angular_velocity_relative, true},
};

bool has_square(Quantity q) { return q != Quantity::angle && q != Quantity::angle_relative; }

const Model& model_of(const EvalContext& context) {
  if (!context.model || !context.state) fail("there is no model here");
  return *context.model;
}

int structural_index(const Model& model, int label) {
  const int index = model.find_structural(label);
  if (index < 0) fail("structural node " + std::to_string(label) + " is not defined");
  return index;
}

/// Configuration at the last completed step.
NodeState previous_state(const EvalContext& context, int node) {
  const Model& model = *context.model;
  const State& state = *context.state;
  const StructuralNode& n = model.structural[node];
  if (context.phase == Phase::input || state.y1.size() != static_cast<std::size_t>(model.unknowns))
    return model.node_state(context, node);
  if (n.is_dummy())
    fail("values of the last step are not available for dummy node " + std::to_string(n.label));
  NodeState s;
  s.x = Vec3(state.y1[n.first], state.y1[n.first + 1], state.y1[n.first + 2]);
  s.v = Vec3(state.yp1[n.first], state.yp1[n.first + 1], state.yp1[n.first + 2]);
  if (n.has_rotation()) {
    s.R = state.rotation_history[node].R1;
    s.w = state.rotation_history[node].w1;
  }
  return s;
}

NodeState state_of(const EvalContext& context, int label, bool previous) {
  const int node = structural_index(model_of(context), label);
  return previous ? previous_state(context, node) : context.model->node_state(context, node);
}

Vec3 vector_of(const NodeFunction& f, const NodeState& a, const NodeState& b) {
  switch (f.quantity) {
    case Quantity::position:
      return a.x;
    case Quantity::distance:
      return b.x - a.x;
    case Quantity::unit_vector: {
      const Vec3 d = b.x - a.x;
      const double length = d.norm();
      if (length <= 2.2e-16)
        fail("the nodes coincide; the unit vector between them is not defined");
      return d / length;
    }
    case Quantity::angle:
      return vector_of_rotation<double>(a.R);
    case Quantity::angle_relative:
      return vector_of_rotation<double>(Mat3(a.R.transpose() * b.R));
    case Quantity::velocity:
      return a.v;
    case Quantity::velocity_relative:
      return b.v - a.v;
    case Quantity::angular_velocity:
      return a.w;
    case Quantity::angular_velocity_relative:
      return b.w - a.w;
  }
  return Vec3::Zero();
}

}  // namespace

int NodeFunction::nodes() const {
  switch (quantity) {
    case Quantity::distance:
    case Quantity::unit_vector:
    case Quantity::angle_relative:
    case Quantity::velocity_relative:
    case Quantity::angular_velocity_relative:
      return 2;
    default:
      return 1;
  }
}

NodeFunction NodeFunction::from_code(int code) {
  NodeFunction f;
  f.previous = code % 2;
  f.part = static_cast<Part>(code / 2 % 5);
  f.quantity = static_cast<Quantity>(code / 10);
  return f;
}

bool find_node_function(std::string_view name, NodeFunction* function) {
  constexpr std::string_view suffix = "_prev";
  NodeFunction f;
  if (name.size() > suffix.size() && name.substr(name.size() - suffix.size()) == suffix) {
    f.previous = true;
    name.remove_suffix(suffix.size());
  }
  for (const QuantityName& q : kQuantities) {
    const std::string_view base = q.name;
    f.quantity = q.quantity;
    if (q.whole && name == base) {
      f.part = Part::norm;
    } else if (q.whole && has_square(q.quantity) && name.size() == base.size() + 1 &&
               name.back() == '2' && name.substr(0, base.size()) == base) {
      f.part = Part::square;
    } else if (name.size() == base.size() + 1 && name[0] >= 'x' && name[0] <= 'z' &&
               name.substr(1) == base) {
      f.part = static_cast<Part>(static_cast<int>(Part::x) + name[0] - 'x');
    } else {
      continue;
    }
    *function = f;
    return true;
  }
  return false;
}

std::string nearest_model_function(std::string_view name) {
  Nearest nearest(name);
  for (const char* other : {"drive", "drivep", "current"}) nearest.consider(other);
  for (const QuantityName& q : kQuantities)
    for (const char* prefix : {"", "x", "y", "z"})
      for (const char* suffix : {"", "_prev"})
        nearest.consider(std::string(prefix) + q.name + suffix);
  return nearest.best();
}

double evaluate(const NodeFunction& f, const EvalContext& context, int label_a, int label_b) {
  const NodeState a = state_of(context, label_a, f.previous);
  // The reference solver subtracts the previous velocity of the first node from the present one of
  // the second.
  const bool previous_b = f.previous && f.quantity != Quantity::velocity_relative;
  const NodeState b = f.nodes() == 2 ? state_of(context, label_b, previous_b) : a;
  const Vec3 v = vector_of(f, a, b);
  switch (f.part) {
    case Part::norm:
      return v.norm();
    case Part::square:
      return v.squaredNorm();
    default:
      return v(static_cast<int>(f.part) - static_cast<int>(Part::x));
  }
}

double evaluate_drive(const EvalContext& context, int label, double argument, bool derivative) {
  const NamedDrive* const found = model_of(context).find_drive(label);
  if (!found) fail("drive caller " + std::to_string(label) + " is not defined");
  NestedEvaluation::charge(found->evaluations);
  const Drive& drive = *found->drive;
  if (!derivative) return drive.value(context, argument);
  if (!drive.has_derivative()) fail("drive caller " + std::to_string(label) + " has no derivative");
  return drive.derivative(context, argument);
}

// -------------------------------------------------------------------------------------------------------
// private data

int node_type(std::string_view word) {
  const auto found = std::ranges::find(kNodeWords, normalized(word));
  return found == kNodeWords.end() ? -1 : static_cast<int>(found - kNodeWords.begin());
}

namespace {

class StructuralDatum : public Drive {
 public:
  StructuralDatum(int node, int datum) : node_(node), datum_(datum) {}
  using Drive::value;
  double value(const EvalContext& context, double) const override {
    return model_of(context).structural_datum_value(context, node_, datum_);
  }
  void collect_followed(std::vector<NodeDof>& dofs) const override {
    if (const auto dof = Model::dof_of_structural_datum(node_, datum_)) dofs.push_back(*dof);
  }
  void write_slopes(const EvalContext&, double factor, double*& next) const override {
    if (Model::dof_of_structural_datum(node_, datum_)) *next++ = factor;
  }

 private:
  int node_, datum_;
};

class DofValue : public Drive {
 public:
  DofValue(NodeDof dof, bool previous) : dof_(dof), previous_(previous) {}
  using Drive::value;
  double value(const EvalContext& context, double) const override {
    const Model& model = model_of(context);
    if (!previous_ || context.phase == Phase::input || context.state->y1.empty())
      return model.dof_value(context, dof_);
    const auto& y = dof_.order ? context.state->yp1 : context.state->y1;
    if (!dof_.structural) {
      const int unknown = model.scalars[dof_.node].unknown;
      return unknown < 0 ? model.dof_value(context, dof_) : y[unknown];
    }
    const NodeState s = previous_state(context, dof_.node);
    const int k = dof_.component % 3;
    if (dof_.component < 3) return dof_.order ? s.v(k) : s.x(k);
    return dof_.order ? s.w(k) : vector_of_rotation<double>(s.R)(k);
  }
  void collect_followed(std::vector<NodeDof>& dofs) const override {
    if (!previous_) dofs.push_back(dof_);
  }
  void write_slopes(const EvalContext&, double factor, double*& next) const override {
    if (!previous_) *next++ = factor;
  }

 private:
  NodeDof dof_;
  bool previous_;
};

class ElementDatum final : public Drive {
 public:
  ElementDatum(ElementRef element, int datum) : element_(element), datum_(datum) {}
  using Drive::value;
  double value(const EvalContext& context, double) const override {
    const NestedEvaluation nested;
    return element_.set->private_value(context, element_.index, datum_);
  }

 private:
  ElementRef element_;
  int datum_;
};

/// `type`: as `node_type` counts.
ScalarKind scalar_kind(int type) { return static_cast<ScalarKind>(type - 1); }
std::string entity(int type, int label) {
  return std::string(kNodeWords.begin()[type]) + " node " + std::to_string(label);
}

int scalar_index(const Model& model, int type, int label) {
  const int index = model.find_scalar(scalar_kind(type), label);
  if (index < 0) fail(entity(type, label) + " is not defined");
  return index;
}

/// The datum by number or, when there is only one, without a name.
std::string choose_datum(const std::vector<std::string>& names, std::string_view datum, int index,
                         const std::string& owner) {
  if (!datum.empty()) return std::string(datum);
  const int count = static_cast<int>(names.size());
  if (index == 0 && count == 1) index = 1;
  if (index == 0) fail(owner + " has " + std::to_string(count) + " private data; name one");
  if (index < 1 || index > count)
    fail(owner + " has " + std::to_string(count) + " private data; index " + std::to_string(index));
  return names[index - 1];
}

[[noreturn]] void fail_datum(const std::string& owner, const std::string& name,
                             const std::vector<std::string>& names) {
  std::string known;
  for (const std::string& n : names) {
    if (known.size() > 200) break;
    known += (known.empty() ? "" : ", ") + n;
  }
  fail(owner + " has no private datum \"" + name + '"' +
       (known.empty() ? "" : "; it has " + known));
}

}  // namespace

DrivePtr node_datum(const Model& model, int type, int label, std::string_view datum, int index) {
  const std::string owner = entity(type, label);
  if (type == 0) {
    const int node = structural_index(model, label);
    const std::vector<std::string> names = Model::structural_data_names(model.structural[node]);
    const std::string name = choose_datum(names, datum, index, owner);
    const int k = model.structural_datum(node, name);
    if (k < 0) fail_datum(owner, name, names);
    return std::make_shared<StructuralDatum>(node, k);
  }
  const int node = scalar_index(model, type, label);
  const bool has_rate =
      model.scalars[node].differential && scalar_kind(type) != ScalarKind::parameter;
  std::vector<std::string> names = {"x"};
  if (has_rate) names.push_back("xP");
  const std::string name =
      datum.empty() && index == 0 ? "x" : choose_datum(names, datum, index, owner);
  if (name != "x" && !(has_rate && name == "xP")) fail_datum(owner, name, names);
  NodeDof dof;
  dof.node = node;
  dof.order = name == "xP" ? 1 : 0;
  dof.differential = model.scalars[node].differential;
  return std::make_shared<DofValue>(dof, false);
}

DrivePtr element_datum(ElementRef element, int datum) {
  return std::make_shared<ElementDatum>(element, datum);
}

DrivePtr element_datum(const Model& model, Family family, bool has_label, int label,
                       std::string_view datum, int index) {
  ElementRef element;
  if (has_label) {
    element = model.find_element(family, label);
  } else {
    for (const ElementRef& e : model.elements)
      if (e.set->info(e.index).family == family) element = e;
  }
  std::string owner = family_name(family);
  if (has_label) owner += " " + std::to_string(label);
  if (!element.set) fail(owner + " is not defined");
  const std::vector<std::string> names = element.set->data_names(element.index);
  const std::string name = choose_datum(names, datum, index, owner);
  const int k = element.set->private_datum(element.index, name);
  if (k < 0) fail_datum(owner, name, names);
  return element_datum(element, k);
}

DrivePtr dof_value(const Model& model, int type, int label, int component, int order,
                   bool previous) {
  NodeDof dof;
  dof.structural = type == 0;
  dof.order = order;
  if (type > 0) {
    dof.node = scalar_index(model, type, label);
    dof.differential = model.scalars[dof.node].differential;
    if (order > 0 && !dof.differential) fail(entity(type, label) + " is algebraic and has no rate");
    if (component > 1)
      fail(entity(type, label) + " has 1 degree of freedom; index " + std::to_string(component));
    return std::make_shared<DofValue>(dof, previous);
  }
  dof.node = structural_index(model, label);
  const int count = model.structural[dof.node].position_unknowns();
  if (component < 1 || component > count)
    fail(entity(type, label) + " has " + std::to_string(count) + " degrees of freedom; index " +
         std::to_string(component));
  dof.component = component - 1;
  return std::make_shared<DofValue>(dof, previous);
}

}  // namespace mbcosim
