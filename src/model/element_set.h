/// The face that one contiguous set of elements of a type shows to the model and the solver.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "math/types.h"
#include "model/context.h"
#include "model/datum.h"
#include "model/diagnostic.h"
#include "model/family.h"
#include "model/fwd.h"
#include "model/state.h"

namespace mbcosim {

class OutputRow;

/// A number of a `driven` element that is taken anew from the model's state whenever the element
/// becomes active (`hint` of `driven`, input manual): State::memory[memory] = source.
struct HintSample {
  DrivePtr source;
  int memory = -1;
  bool at_start = true;  ///< also when the element is active from the beginning of the run
};

/// What every element has, whatever it is.
struct ElementInfo {
  Family family = Family::joint;
  int label = 0;
  std::string type;  ///< "revolute hinge"
  std::string name;
  SourceSpan where;
  bool output = true;
  DrivePtr driven;                ///< active while non-zero; null: always active
  int active_memory = -1;         ///< offset in State::memory when driven: is it active? was it at
                                  ///< the last prediction?
  int order = 0;                  ///< declaration order over all elements
  std::vector<HintSample> hints;  ///< of `driven`
};

/// How dependences of a node's kinematics on its Newton increments enter Jacobians: δx = c δ,
/// δv = δ for the position unknowns; δθ = A δ, δw = B δ for the rotation unknowns.
struct NodeSeeds {
  Mat3 A;  ///< c G(g)
  Mat3 B;  ///< ∂w/∂δ
};

/// A state without meaning, of which no coordinate, rate or multiplier is special: what vanishes in
/// the Jacobian there vanishes everywhere, unless a type branches on its state.
struct StructureProbe {
  EvalContext context;
  std::vector<NodeSeeds> seeds;  ///< (structural nodes)
};

/// Collects which rows meet which columns; the answer is where each entry of a dense block lies in
/// the sparse values.
class PatternSink {
 public:
  virtual ~PatternSink() = default;
  /// Announces a dense block (rows × columns). Negative rows and columns are skipped.
  virtual void block(const int* rows, int row_count, const int* columns, int column_count) = 0;
  virtual void entry(int row, int column) = 0;  ///< a single one, not negative
};
class PositionSource {
 public:
  virtual ~PositionSource() = default;
  /// Position of entry (row, column) in the value array; -1 when row or column is negative.
  virtual int position(int row, int column) const = 0;
};

/// Mass properties about a node's origin, global frame.
struct Inertia {
  double m = 0;           ///< [kg]
  Vec3 S = Vec3::Zero();  ///< first moment [kg·m]
  Mat3 J = Mat3::Zero();  ///< second moment [kg·m²]
  /// Of masses that move relative to the node or change: their share of the momenta about the node,
  /// and of the momenta's rates what no acceleration of the node gives.
  Vec3 b = Vec3::Zero(), g = Vec3::Zero();            ///< [kg·m/s], [kg·m²/s]
  Vec3 b_rate = Vec3::Zero(), g_rate = Vec3::Zero();  ///< [N], [N·m]
};

/// Elements first .. last − 1 of a set.
struct ElementRange {
  int first, last;
};

enum class AssemblyRole {
  none,       ///< takes no part
  holonomic,  ///< rows are position constraints; rates by differentiation in time
  elastic,    ///< its loads enter the position rows only
  custom      ///< writes both levels itself
};

class ElementSet {
 public:
  virtual ~ElementSet() = default;

  virtual int size() const = 0;
  virtual const ElementInfo& info(int i) const = 0;
  virtual ElementInfo& info(int i) = 0;  ///< while the model is built: ModelBuilder::info

  // --- unknowns and structure, while the model is being finished
  virtual int unknowns(int i) const = 0;                 ///< number of own unknowns of element i
  virtual bool is_differential(int i, int k) const = 0;  ///< kind of own unknown k
  virtual std::string row_name(int i, int k) const = 0;  ///< meaning of own row k
  virtual std::vector<int> nodes(
      int i) const = 0;                    ///< structural nodes it is attached to (indices)
  virtual int first_own(int i) const = 0;  ///< first own unknown, as given to bind
  /// Where element i sums over others: offset in Scratch::sums, −1 when it does not.
  virtual int first_sum(int i) const;
  virtual void bind(const Model& model, int i,
                    int first_own) = 0;  ///< own unknowns start at first_own
  /// Lets the hint `hint` ("offset{1}") of `driven` move a part of element i; false when the
  /// element has no such part.
  virtual bool add_hint(ModelBuilder& builder, int i, std::string_view hint);
  /// Looks which entries of the local matrices can differ from zero; the others stay out of the
  /// pattern. Without probes none is left out.
  virtual void find_structure(const std::vector<StructureProbe>& probes);
  virtual void collect_pattern(PatternSink& sink) const = 0;
  /// All rows that element i adds to, once it is bound; −1 stands for none.
  virtual void append_rows(const Model& model, int i, std::vector<int>& rows) const = 0;
  virtual void set_positions(const PositionSource& positions) = 0;

  // --- evaluation
  /// Initial values of own unknowns and memory of element i; also when a `driven` element becomes
  /// active.
  virtual void start(const EvalContext& context, State& state, int i) const = 0;
  /// After an initial assembly that moved something: multipliers restart from zero, the rest from
  /// `start`.
  virtual void after_assembly(const EvalContext& context, State& state, int i) const;
  /// Adds to r (n).
  virtual void residual(const EvalContext& context, double* r, ElementRange range) const = 0;
  /// Adds −∂r/∂δ to the sparse values; seeds by structural node index.
  virtual void jacobian(const EvalContext& context, const NodeSeeds* seeds, double* values,
                        ElementRange range) const = 0;
  /// Before the first residual of the derivatives phase, and before the second.
  virtual void at_derivatives(const EvalContext& context, State& state, ElementRange range,
                              bool first) const;
  // --- stages around it, in the order of families (StageRank)
  /// Do the stages of element i touch nothing but the nodes it is attached to and its own memory,
  /// so that such elements can be taken at the same time?
  virtual bool stages_apart(int i) const;
  /// Once a step, after the prediction.
  virtual void after_predict(const EvalContext& context, State& state,
                             ElementRange range) const = 0;
  /// Adds to what elements sum over others (Scratch::sums). Before each residual and each Jacobian.
  virtual void accumulate(const EvalContext& context, ElementRange range) const;
  virtual bool accumulates() const { return false; }
  virtual void after_convergence(const EvalContext& context, State& state,
                                 ElementRange range) const = 0;

  // --- initial assembly: state.y, yp hold positions and rates, multipliers λ and λ′
  // (solver/initial_assembly.h)
  virtual AssemblyRole assembly_role(int i) const = 0;
  /// Does own row k constrain a velocity alone?
  virtual bool constrains_velocity(int /*i*/, int /*k*/) const { return false; }
  /// Adds to position-level rows r (n) and rate-level rows r_rate (n), both in the model's row
  /// numbering.
  virtual void assembly_residual(const EvalContext& context, int i, double* r,
                                 double* r_rate) const = 0;
  /// Appends −∂(r, r_rate)/∂(y, yp) of element i: row and column numbers ≥ n mean the rate level.
  struct Triplet {
    int row, column;
    double value;
  };
  virtual void assembly_jacobian(const EvalContext& context, int i, int n,
                                 std::vector<Triplet>& out) const = 0;

  // --- results
  virtual void output(const EvalContext& context, int i, OutputRow& row) const = 0;
  virtual std::string log_line(const Model& model,
                               int i) const = 0;  ///< line of .log without newline; may be empty
  virtual int private_datum(int i, std::string_view name) const = 0;  ///< index, or -1
  virtual std::vector<Datum> private_data(int i) const = 0;
  virtual double private_value(const EvalContext& context, int i, int datum) const = 0;
  /// Adds the inertia that element i attaches to structural node `node` (global frame, about the
  /// node).
  virtual void add_inertia(const EvalContext& context, int i, int node, Inertia& inertia) const = 0;
  /// Adds the momentum of element i to the initial momentum of its nodes.
  virtual void add_momentum(const EvalContext& context, int i, State& state) const = 0;

  ElementRange all() const { return {0, size()}; }
  std::vector<std::string> data_names(int i) const;  ///< of private_data
  bool is_active(const State& state, int i) const {
    const int m = info(i).active_memory;
    return m < 0 || state.memory[m] != 0;
  }
};

/// Position of an element in the model.
struct ElementRef {
  const ElementSet* set = nullptr;
  int index = -1;
};

/// Some elements of a set, one after another.
struct ElementSpan {
  const ElementSet* set = nullptr;
  ElementRange range{0, 0};
  bool stages_apart = false;  ///< of all of them
};

}  // namespace mbcosim
