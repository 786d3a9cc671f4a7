/// Elements whose size is known only when the deck is read (state spaces, modal joints): one
/// virtual object per element.
///
///     class Filter : public GeneralElement {
///       void connect(GeneralConnection& c) override;  // input_ = c.scalar(node), …
///       // r.add(state_, …)
///       void residual(const GeneralView& u, GeneralResidual& r) const override;
///       // j.value(state_, input_, …)
///       void jacobian(const GeneralView& u, GeneralJacobian& j) const override;
///     };
///     add_general_element(card.builder(), info, std::make_unique<Filter>(…));
///
/// Local rows and columns share one numbering, in the order of the calls in `connect`: 6 for a
/// structural node (equilibrium rows; x and rotation columns), all of its unknowns for a whole
/// node, 1 for a scalar node, 1 for an own unknown. `connect` and its like return the first local
/// number. Elements of fixed small size use elements/element.h.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "model/check.h"
#include "model/context.h"
#include "model/element_set.h"
#include "model/model.h"
#include "model/output_row.h"
#include "model/sampled_table.h"

namespace mbcosim {

/// Where a general element is attached.
class GeneralConnection {
 public:
  explicit GeneralConnection(ModelBuilder& builder) : builder_(&builder) {}
  /// Six equilibrium rows and six position columns (displacement nodes: the last three do not
  /// exist).
  int node(int structural_node) { return add_node(structural_node, false); }
  /// All rows and columns of a node in the order of its unknowns, e.g. the twelve of a modal node.
  int whole_node(int structural_node) { return add_node(structural_node, true); }
  int scalar(int scalar_node);
  /// A scalar dof of any node: its local row and column (position components only for structural
  /// nodes).
  int dof(const NodeDof& dof);
  /// What a drive follows at once gets columns without rows when the model is complete:
  /// GeneralJacobian::each_followed.
  void drive(const DrivePtr& drive) { followed_.push_back({drive.get(), {}, {}}); }
  int algebraic(int count) { return own(count, false); }
  int differential(int count) { return own(count, true); }
  int memory(int count, double initial = 0);  ///< offset from the element's first memory slot
  int scratch(int count);                     ///< offset in what GeneralView::scratch gives

 private:
  friend class GeneralElementSet;
  friend class GeneralView;
  friend class GeneralJacobian;
  struct Entry {
    enum Kind { node, whole_node, scalar, own } kind;
    int index;  ///< structural or scalar node, or number of the own unknown
    int first;  ///< local number
  };
  struct Followed {
    const Drive* drive;
    std::vector<NodeDof> dofs;
    std::vector<int> columns;  ///< local numbers of the dofs; -1 where the matrix leaves one out
  };
  int add_node(int structural_node, bool whole);
  int own(int count, bool differential);
  void find_followed(const Model& model);
  int column_of(const Model& model, const NodeDof& dof);

  ModelBuilder* builder_;
  std::vector<Entry> entries_;
  std::vector<char> own_differential_;
  int size_ = 0;  ///< local rows = local columns
  int first_own_ = -1, memory_ = -1, memory_count_ = 0, scratch_count_ = 0;
  std::vector<int> rows_, columns_;  ///< model's numbers by local number, -1: none; filled by bind
  std::vector<Followed> followed_;   ///< by drives
  std::vector<int> parameter_;  ///< parameter nodes: offset of the value in State::memory, else -1
};

/// Announces which local rows meet which local columns.
class GeneralPattern {
 public:
  /// The number of local rows, and of local columns.
  explicit GeneralPattern(int size) : size_(size) {}
  void block(int row, int rows, int column, int columns) {
    blocks_.push_back({row, rows, column, columns});
  }
  void dense() {
    if (size_ > 0) block(0, size_, 0, size_);
  }
  struct Block {
    int row, rows, column, columns;
  };
  const std::vector<Block>& blocks() const { return blocks_; }

 private:
  int size_;
  std::vector<Block> blocks_;
};

/// Where the entries of an element's local matrix are among the values of the model's. Of one with
/// many rows, such as a port on thousands of nodes, only those of its pattern are kept.
class GeneralPlaces {
 public:
  GeneralPlaces() = default;
  /// `place(row, column)`: of local numbers.
  template <class Place>
  GeneralPlaces(int size, const std::vector<GeneralPattern::Block>& blocks, Place place);
  /// -1: it has none.
  int at(int row, int column) const {
    if (starts_.empty()) return places_[static_cast<std::size_t>(column) * size_ + row];
    const auto first = rows_.begin() + starts_[column], last = rows_.begin() + starts_[column + 1];
    const auto found = std::lower_bound(first, last, row);
    return found == last || *found != row ? -1 : places_[found - rows_.begin()];
  }

 private:
  static constexpr int kLargestWhole = 128;
  std::size_t size_ = 0;
  std::vector<int> places_;             ///< (size × size), column-major, or of `rows_`
  std::vector<int> rows_;               ///< sorted, column by column
  std::vector<std::ptrdiff_t> starts_;  ///< of the columns in `rows_`; empty: all are kept
};

template <class Place>
GeneralPlaces::GeneralPlaces(int size, const std::vector<GeneralPattern::Block>& blocks,
                             Place place)
    : size_(static_cast<std::size_t>(size)) {
  if (size <= kLargestWhole) {
    places_.resize(size_ * size_);
    for (int j = 0; j < size; ++j)
      for (int i = 0; i < size; ++i) places_[j * size_ + i] = place(i, j);
    return;
  }
  std::vector<std::vector<int>> columns(size_);
  for (const GeneralPattern::Block& b : blocks)
    for (int j = b.column; j < b.column + b.columns; ++j)
      for (int i = b.row; i < b.row + b.rows; ++i) columns[j].push_back(i);
  starts_.push_back(0);
  for (int j = 0; j < size; ++j) {
    std::vector<int>& rows = columns[j];
    std::sort(rows.begin(), rows.end());
    rows.erase(std::unique(rows.begin(), rows.end()), rows.end());
    for (const int i : rows) {
      rows_.push_back(i);
      places_.push_back(place(i, j));
    }
    starts_.push_back(static_cast<std::ptrdiff_t>(rows_.size()));
    rows = {};
  }
}

/// What a general element sees of the state. Local numbers as returned by GeneralConnection.
class GeneralView {
 public:
  GeneralView(const EvalContext& c, const GeneralConnection& connection, const ElementInfo& i)
      : context(c), info(i), connection_(connection) {}
  const Model& model() const { return *context.model; }
  const State& state() const { return *context.state; }
  NodeState node(int structural_node) const { return model().node_state(context, structural_node); }
  /// Rotation parameters of the step and their rates.
  Vec3 g(int structural_node) const;
  Vec3 gp(int structural_node) const;
  double value(int local) const;  ///< of a scalar dof or own unknown
  double rate(int local) const;
  double dof(const NodeDof& d) const { return model().dof_value(context, d); }
  double drive(const DrivePtr& d) const { return d->value(context); }
  double memory(int i) const { return state().memory[connection_.memory_ + i]; }
  int memory_offset() const { return connection_.memory_; }
  /// The numbers asked for in `connect`; what they hold at entry means nothing.
  double* scratch() const {
    MBCOSIM_CHECK(context.scratch, "scratch is used where there is none");
    return context.scratch->local.data();
  }
  /// Unknown (model's number) behind a local column; -1 when there is none.
  int unknown(int local) const { return connection_.columns_[local]; }
  double c() const { return context.c; }
  double time() const { return context.time; }
  int label() const { return info.label; }

  const EvalContext& context;
  const ElementInfo& info;

 private:
  const GeneralConnection& connection_;
};

/// Adds to the model's residual by local row.
class GeneralResidual {
 public:
  GeneralResidual(const std::vector<int>& rows, double* r) : rows_(rows), r_(r) {}
  void add(int row, double value) {
    if (rows_[row] >= 0) r_[rows_[row]] += value;
  }
  void add3(int row, const Vec3& value) {
    for (int i = 0; i < 3; ++i) add(row + i, value(i));
  }
  /// An equation of another element, by the model's number; one of GeneralElement::other_rows.
  void add_to_equation(int equation, double value) { r_[equation] += value; }
  /// Force [N] and moment about the node [N·m] on the equilibrium rows that start at `row`.
  void load(int row, const Vec3& f, const Vec3& m) {
    add3(row, f);
    add3(row + 3, m);
  }

 private:
  const std::vector<int>& rows_;
  double* r_;
};

/// Adds −∂r/∂δ to the sparse matrix by local row and column.
class GeneralJacobian {
 public:
  GeneralJacobian(const EvalContext& context, const GeneralConnection& connection,
                  const NodeSeeds* seeds, const GeneralPlaces& places, double* values)
      : context_(context),
        connection_(connection),
        seeds_(seeds),
        places_(places),
        values_(values) {}
  /// An entry of −∂r/∂δ as it is.
  void add(int row, int column, double value) {
    const int p = places_.at(row, column);
    if (p >= 0) values_[p] += value;
  }
  /// Given ∂r/∂(value) and ∂r/∂(rate) of a scalar dof, own unknown or position component.
  void value(int row, int column, double dr) { add(row, column, -dr * value_factor(column)); }
  void rate(int row, int column, double dr) { add(row, column, -dr * rate_factor(column)); }
  /// Rows row..row+2, columns column..column+2 of the x (or v of a whole node): given ∂r/∂x, ∂r/∂v.
  void translation(int row, int column, const Mat3& dx, const Mat3& dv) {
    add3(row, column, -(dx * context_.seed + dv));
  }
  /// Columns of the rotation of `structural_node` starting at `column`: given ∂r/∂θ, ∂r/∂w (global
  /// components).
  void rotation(int row, int column, int structural_node, const Mat3& dtheta, const Mat3& dw) {
    add3(row, column, -(dtheta * seeds_[structural_node].A + dw * seeds_[structural_node].B));
  }
  /// Given ∂r/∂(value of a dof at its order); `column`: its local number. Second derivatives are
  /// left out.
  void dof(int row, int column, const NodeDof& d, double dr);
  /// Calls use(column, dof, slope), for `dof` above, with all that a drive follows at once.
  template <class Use>
  void each_followed(const DrivePtr& d, Use use) const;
  void add3(int row, int column, const Mat3& m) {
    for (int j = 0; j < 3; ++j)
      for (int i = 0; i < 3; ++i) add(row + i, column + j, m(i, j));
  }
  double value_factor(int column) const;  ///< ∂(value)/∂δ: c, or 1 for algebraic unknowns
  double rate_factor(int column) const;   ///< ∂(rate)/∂δ: 1, or 0 for algebraic unknowns

 private:
  const EvalContext& context_;
  const GeneralConnection& connection_;
  const NodeSeeds* seeds_;
  const GeneralPlaces& places_;
  double* values_;
};

template <class Use>
void GeneralJacobian::each_followed(const DrivePtr& d, Use use) const {
  if (!context_.follows) return;
  for (const GeneralConnection::Followed& followed : connection_.followed_) {
    if (followed.drive != d.get() || followed.dofs.empty()) continue;
    std::array<double, kMaxFollowed> slopes;
    double* next = slopes.data();
    d->write_slopes(context_, 1, next);
    for (std::size_t k = 0; k < followed.dofs.size(); ++k)
      if (followed.columns[k] >= 0 && std::isfinite(slopes[k]))
        use(followed.columns[k], followed.dofs[k], slopes[k]);
    return;
  }
}

/// Interface of one general element; the meaning of each member as in ElementSet.
class GeneralElement {
 public:
  virtual ~GeneralElement() = default;
  virtual void connect(GeneralConnection& c) = 0;
  virtual void pattern(GeneralPattern& p) const { p.dense(); }
  /// Appends the equations of other elements that it adds to.
  virtual void other_rows(std::vector<int>& /*rows*/) const {}
  virtual void residual(const GeneralView& u, GeneralResidual& r) const = 0;
  virtual void jacobian(const GeneralView& u, GeneralJacobian& j) const = 0;

  virtual void start(const GeneralView&, State&) const {}
  virtual void after_predict(const GeneralView&, State&) const {}
  virtual void after_convergence(const GeneralView&, State&) const {}
  virtual std::string row_name(int own) const { return "equation " + std::to_string(own + 1); }

  virtual AssemblyRole assembly_role() const { return AssemblyRole::none; }
  /// Position-level rows and rate-level rows; its Jacobian is taken by central differences.
  virtual void assembly_residual(const GeneralView&, GeneralResidual& /*r*/,
                                 GeneralResidual& /*r_rate*/) const {}

  virtual void output(const GeneralView&, OutputRow&) const {}
  virtual std::string log(const Model&, int /*label*/) const { return {}; }
  virtual int private_datum(std::string_view) const { return -1; }
  virtual std::vector<Datum> private_data() const { return {}; }
  virtual double private_value(const GeneralView&, int /*datum*/) const { return 0; }
  virtual void add_inertia(const GeneralView&, int /*node*/, Inertia&) const {}
  virtual void add_momentum(const GeneralView&, State&) const {}
  /// Does it write rows of samples? Offsets in `table` count from the element's first memory slot.
  virtual bool sampled_table(SampledTable&) const { return false; }
};

/// All general elements of a model.
class GeneralElementSet final : public ElementSet, public SampledTableSource {
 public:
  void add(ModelBuilder& builder, ElementInfo info, std::unique_ptr<GeneralElement> element);
  const GeneralElement& element(int i) const { return *slots_[i].element; }
  /// What element i sees.
  GeneralView view(const EvalContext& context, int i) const {
    return GeneralView(context, slots_[i].connection, slots_[i].info);
  }

  int size() const override { return static_cast<int>(slots_.size()); }
  const ElementInfo& info(int i) const override { return slots_[i].info; }
  ElementInfo& info(int i) override { return slots_[i].info; }
  int unknowns(int i) const override {
    return static_cast<int>(slots_[i].connection.own_differential_.size());
  }
  bool is_differential(int i, int k) const override {
    return slots_[i].connection.own_differential_[k] != 0;
  }
  std::string row_name(int i, int k) const override { return slots_[i].element->row_name(k); }
  std::vector<int> nodes(int i) const override;
  int first_own(int i) const override { return slots_[i].connection.first_own_; }
  void bind(const Model& model, int i, int first_own) override;
  void collect_pattern(PatternSink& sink) const override;
  void append_rows(const Model& model, int i, std::vector<int>& rows) const override;
  void set_positions(const PositionSource& positions) override;
  void start(const EvalContext& context, State& state, int i) const override;
  void residual(const EvalContext& context, double* r, ElementRange range) const override;
  void jacobian(const EvalContext& context, const NodeSeeds* seeds, double* values,
                ElementRange range) const override;
  void after_predict(const EvalContext& context, State& state, ElementRange range) const override;
  void after_convergence(const EvalContext& context, State& state,
                         ElementRange range) const override;
  AssemblyRole assembly_role(int i) const override { return slots_[i].element->assembly_role(); }
  void assembly_residual(const EvalContext& context, int i, double* r,
                         double* r_rate) const override;
  void assembly_jacobian(const EvalContext& context, int i, int n,
                         std::vector<Triplet>& out) const override;
  void output(const EvalContext& context, int i, OutputRow& row) const override;
  std::string log_line(const Model& model, int i) const override;
  int private_datum(int i, std::string_view name) const override {
    return slots_[i].element->private_datum(name);
  }
  std::vector<Datum> private_data(int i) const override {
    return slots_[i].element->private_data();
  }
  double private_value(const EvalContext& context, int i, int datum) const override;
  void add_inertia(const EvalContext& context, int i, int node, Inertia& inertia) const override;
  void add_momentum(const EvalContext& context, int i, State& state) const override;
  std::vector<SampledTable> sampled_tables() const override;

 private:
  struct Slot {
    std::unique_ptr<GeneralElement> element;
    ElementInfo info;
    GeneralConnection connection;
    GeneralPlaces places;
  };
  static GeneralPattern pattern_of(const Slot& slot);
  std::vector<Slot> slots_;
};

ElementRef add_general_element(ModelBuilder& builder, ElementInfo info,
                               std::unique_ptr<GeneralElement> element);

}  // namespace mbcosim
