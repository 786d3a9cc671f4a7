/// Model: everything that is fixed once a deck is read. Immutable and shared between sessions and
/// threads: what is const is so to the last element. One part of it keeps what it has computed,
/// behind an atomic pointer and without a trace in any result: drives in the hints of `driven`
/// (input/late_drive.cpp).
#pragma once

#include <array>
#include <experimental/propagate_const>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include "model/assembly_plan.h"
#include "model/context.h"
#include "model/diagnostic.h"
#include "model/drive.h"
#include "model/element_set.h"
#include "model/fwd.h"
#include "model/node.h"
#include "model/node_equations.h"
#include "model/scratch.h"
#include "model/settings.h"
#include "model/sparse_pattern.h"
#include "model/state.h"
#include "model/structural_port.h"

namespace mbcosim {

/// A run-time function of the state that is evaluated at every use, bound to a name in run-time
/// strings (plugin variables).
struct NamedDrive {
  int label = 0;
  std::string name;
  DrivePtr drive;
  bool output_value = false, output_derivative = false;
  int evaluations = 1;  ///< of drives and functions, for one value
};

/// Gravity field: uniform (vector drive) or central.
struct Gravity {
  Vec3DrivePtr uniform;        ///< acceleration, global [m/s²]; null for central gravity
  Vec3 origin = Vec3::Zero();  ///< central: centre [m]
  double mass_g = 0;           ///< central: M·G [m³/s²]
  bool output = false;
  int label = 0;
};

/// `rigid body kinematics`: motion of the relative frame in which the model is written. Null drives
/// are zero. As MBDyn has it, what `drive` gives are components in absolute axes, which
/// `orientation` turns; `const` has them in the moving ones.
struct FrameMotion {
  bool in_absolute_axes = false;
  Vec3DrivePtr position, orientation, velocity, angular_velocity, acceleration,
      angular_acceleration;
};

/// A `reference` card, kept for `.rfm` output.
struct ReferenceFrame {
  int label = 0;
  std::string name;
  SourceSpan where;
  Vec3 x = Vec3::Zero();
  Mat3 R = Mat3::Identity();
  Vec3 v = Vec3::Zero(), w = Vec3::Zero();
};

/// Values that a coupled peer feeds into the model: a `stream` file driver.
struct StreamInput {
  std::string name;
  int channels = 0;
  int memory = -1;            ///< offset of the values in State::memory (channels)
  int every = 1;              ///< steps between two exchanges
  bool receive_first = true;  ///< exchange at the initial time, too
  SourceSpan where;
};

enum class UnknownKind : std::uint8_t { differential, algebraic };

class Model {
 public:
  std::string title;
  std::uint64_t digest = 0;  ///< hash of the deck and everything it read
  InitialValueSettings initial_value;
  ControlSettings control;

  std::vector<StructuralNode> structural;
  std::vector<ScalarNode>
      scalars;  ///< electric, thermal, abstract, hydraulic, parameter nodes in declaration order
  std::vector<std::experimental::propagate_const<std::unique_ptr<ElementSet>>> sets;
  std::vector<ElementRef> elements;  ///< in declaration order
  std::vector<NamedDrive> drives;    ///< `drive caller` cards
  std::vector<std::shared_ptr<const StepListener>> step_listeners;
  std::vector<ReferenceFrame> frames;
  std::optional<Gravity> gravity;
  std::optional<FrameMotion> frame_motion;
  std::vector<double> initial_memory;     ///< State::memory at the start
  std::vector<double> initial_variables;  ///< State::variables at the start
  std::vector<std::string> log_lines;     ///< extra lines of .log, e.g. of `inertia`
  /// (name, printed value) of the deck's variables, sorted; for .log.
  std::vector<std::pair<std::string, std::string>> symbols;

  std::vector<StreamInput> stream_inputs;
  std::vector<StructuralPort> structural_ports;
  /// `default scale` of the rows that each family of elements owns.
  std::array<double, kFamilies> family_scale = [] {
    std::array<double, kFamilies> a;
    a.fill(1);
    return a;
  }();

  // --- numbering, set by ModelBuilder::finish
  std::vector<ElementRef> driven;   ///< elements that are `driven`
  std::vector<ElementRef> printed;  ///< elements with output, in declaration order
  int unknowns = 0;                 ///< n
  std::vector<UnknownKind> kinds;   ///< (n)
  std::vector<double> row_scale;    ///< (n) scale of the owner, for `tolerance ..., scale`
  std::vector<std::uint8_t> is_constraint_row;  ///< (n)
  // sparse matrix, compressed columns (n)
  std::vector<int> column_start, row_index;
  /// What elements tie together, entries that always vanish included, hence more than the matrix
  /// has: the order of elimination is chosen on it.
  SparsePattern couplings;
  std::vector<int> diagonal;      ///< position of each diagonal entry, -1 if absent (n)
  std::vector<NodePlace> places;  ///< (structural nodes)
  NodeEquations node_equations;   ///< rows that nodes contribute themselves
  AssemblyPlan assembly;          ///< in which order elements are evaluated
  std::vector<std::vector<ElementRef>> node_bodies;  ///< bodies attached to each structural node
  std::vector<ElementSpan> stage_order;              ///< all elements by the rank of their family
  std::vector<ElementSpan> accumulation;             ///< those of them that add to sums
  ScratchSizes scratch;                              ///< what the elements need

  // --- kinematics
  NodeState node_state(const EvalContext& context,
                       int node) const;  ///< any structural node, also dummy ones
  /// Acceleration of dynamic, modal and dummy nodes; zero for others.
  NodeAcceleration node_acceleration(const EvalContext& context, int node) const;
  Vec3 gravity_at(const EvalContext& context,
                  const Vec3& x) const;  ///< [m/s²], zero without gravity
  Mat3 gravity_gradient(const EvalContext& context, const Vec3& x) const;  ///< ∂a/∂x [1/s²]
  /// A context for `state` as it stands; evaluates a uniform gravity field once.
  EvalContext context(const State& state, Phase phase, double c = 1, double c_algebraic = 1) const;
  /// Value (order 0), rate (1) or second derivative (2) of a node's degree of freedom.
  double dof_value(const EvalContext& context, const NodeDof& dof) const;
  /// Is it an unknown, its rate or an angular velocity?
  bool has_column(const NodeDof& dof) const;

  // --- lookup
  int find_structural(int label) const;  ///< index or -1
  int find_scalar(ScalarKind kind, int label) const;
  const NamedDrive* find_drive(int label) const;            ///< null when there is none
  ElementRef find_element(Family family, int label) const;  ///< set == nullptr when absent
  /// Private datum of a node: index or -1. Structural names: model/node_data.cpp; scalar nodes:
  /// "x", "xP".
  int structural_datum(int node, std::string_view name) const;
  double structural_datum_value(const EvalContext& context, int node, int datum) const;
  /// The degree of freedom that a datum is, if it is one.
  static std::optional<NodeDof> dof_of_structural_datum(int node, int datum);
  static std::vector<std::string> structural_data_names(const StructuralNode& node);

  /// Values in the sparse pattern as a full matrix (n, n).
  MatX dense(const std::vector<double>& values) const;

  // --- diagnosis
  std::string node_text(int node) const;         ///< "structural node 7"
  std::string element_text(ElementRef e) const;  ///< "joint 7 (revolute hinge)"
  /// Owner and meaning of a row, e.g. ("joint 7 (revolute hinge)", "constraint 2").
  std::pair<std::string, std::string> row_text(int row) const;

  // label -> index maps
  std::unordered_map<int, int> structural_index;
  std::unordered_map<int, int> scalar_index[5];
  std::unordered_map<int, ElementRef> element_index[kFamilies];
  std::unordered_map<int, int> drive_index;
};

using ModelPtr = std::shared_ptr<const Model>;

/// Fills a Model while a deck is read. Duplicate labels are refused by the card readers, which know
/// the places.
class ModelBuilder {
 public:
  ModelBuilder();
  Model& model() { return *model_; }
  const Model& model() const { return *model_; }

  int add_structural(StructuralNode node);  ///< returns its index
  int add_scalar(ScalarNode node);
  /// Adds a set of a new element type; `add_element` in elements/element.h does this.
  template <class Set>
  Set& set() {
    auto& slot = sets_[&type_tag<Set>];
    if (!slot) {
      auto owned = std::make_unique<Set>();
      slot = owned.get();
      model_->sets.push_back(std::move(owned));
    }
    return static_cast<Set&>(*slot);
  }
  /// Records the last element of `set` in declaration order and in the label index.
  ElementRef register_element(ElementSet& set);

  /// What all elements have, to be changed while the model is built.
  ElementInfo& info(const ElementRef& element);
  void register_driven(ElementInfo& info);                          ///< which has got its drive
  bool add_hint(const ElementRef& element, std::string_view hint);  ///< ElementSet::add_hint

  int allocate_memory(int count, double initial = 0);  ///< offset in State::memory
  int allocate_sums(int count);                        ///< offset in Scratch::sums
  void require_scratch(int count);                     ///< of one element: Scratch::local
  void set_memory(int offset, double value);           ///< at the start
  void on_step(std::shared_ptr<const StepListener> listener) {
    model_->step_listeners.push_back(std::move(listener));
  }

  /// A context for evaluations while the deck is read: input configuration, initial time.
  const EvalContext& input_context();

  /// Numbers unknowns, builds the sparsity pattern, freezes. The builder is empty afterwards.
  Result<ModelPtr> finish();

 private:
  template <class Set>
  static inline char type_tag = 0;
  std::unique_ptr<Model> model_;
  std::map<const void*, ElementSet*> sets_;
  State input_state_;  ///< its memory is the model's initial one
  EvalContext input_context_;
};

/// Initial State: input configuration of nodes, initial values of elements and memory. Rates of
/// node positions are the velocities; multipliers zero unless an element says otherwise.
State make_initial_state(const Model& model);

}  // namespace mbcosim
