#include <algorithm>
#include <random>

#include "model/check.h"
#include "model/model.h"
#include "model/node_momenta.h"

namespace mbcosim {

ModelBuilder::ModelBuilder() : model_(std::make_unique<Model>()) {}

int ModelBuilder::add_structural(StructuralNode node) {
  const int index = static_cast<int>(model_->structural.size());
  model_->structural_index.emplace(node.label, index);
  if (node.has_momentum()) {
    NodeMomenta& momenta = set<NodeMomenta>();
    momenta.add(node, index);
    model_->element_index[static_cast<int>(Family::automatic_structural)].emplace(
        node.label, ElementRef{&momenta, momenta.size() - 1});
  }
  model_->structural.push_back(std::move(node));
  return index;
}

int ModelBuilder::add_scalar(ScalarNode node) {
  const int index = static_cast<int>(model_->scalars.size());
  if (node.kind == ScalarKind::parameter) node.memory = allocate_memory(1, node.value);
  model_->scalar_index[static_cast<int>(node.kind)].emplace(node.label, index);
  model_->scalars.push_back(std::move(node));
  return index;
}

ElementRef ModelBuilder::register_element(ElementSet& set) {
  const ElementRef ref{&set, set.size() - 1};
  ElementInfo& info = set.info(ref.index);
  info.order = static_cast<int>(model_->elements.size());
  if (info.driven) register_driven(info);
  model_->elements.push_back(ref);
  model_->element_index[static_cast<int>(info.family)].emplace(info.label, ref);
  return ref;
}

void ModelBuilder::register_driven(ElementInfo& info) {
  info.active_memory = allocate_memory(2, 1);
}

namespace {

ElementSet& set_of(Model& model, const ElementRef& e) {
  for (auto& set : model.sets)
    if (set.get() == e.set) return *set;
  MBCOSIM_CHECK(false, "an element of another model");
}

}  // namespace

ElementInfo& ModelBuilder::info(const ElementRef& element) {
  return set_of(*model_, element).info(element.index);
}

bool ModelBuilder::add_hint(const ElementRef& element, std::string_view hint) {
  return set_of(*model_, element).add_hint(*this, element.index, hint);
}

int ModelBuilder::allocate_sums(int count) {
  const int offset = model_->scratch.sums;
  model_->scratch.sums += count;
  return offset;
}

void ModelBuilder::require_scratch(int count) {
  model_->scratch.local = std::max(model_->scratch.local, count);
}

int ModelBuilder::allocate_memory(int count, double initial) {
  const int offset = static_cast<int>(model_->initial_memory.size());
  model_->initial_memory.resize(offset + count, initial);
  input_state_.memory.resize(offset + count, initial);
  return offset;
}

void ModelBuilder::set_memory(int offset, double value) {
  model_->initial_memory[offset] = input_state_.memory[offset] = value;
}

const EvalContext& ModelBuilder::input_context() {
  input_state_.time = model_->initial_value.initial_time;
  if (input_state_.variables.size() != model_->initial_variables.size())
    input_state_.variables = model_->initial_variables;
  input_context_ = EvalContext{};
  input_context_.model = model_.get();
  input_context_.state = &input_state_;
  input_context_.time = input_state_.time;
  input_context_.phase = Phase::input;
  return input_context_;
}

namespace {

/// Gathers (column, row) pairs, then becomes the compressed-column pattern.
class Pattern : public PatternSink, public PositionSource {
 public:
  explicit Pattern(int n) : columns_(n) {}
  void block(const int* rows, int row_count, const int* columns, int column_count) override {
    for (int j = 0; j < column_count; ++j) {
      if (columns[j] < 0) continue;
      std::vector<int>& column = columns_[columns[j]];
      for (int i = 0; i < row_count; ++i)
        if (rows[i] >= 0) column.push_back(rows[i]);
      if (column.size() > 4096) compact(column);
    }
  }
  void entry(int row, int column) override {
    std::vector<int>& entries = columns_[column];
    entries.push_back(row);
    if (entries.size() > 4096) compact(entries);
  }
  SparsePattern compressed() {
    SparsePattern p;
    p.column_start.push_back(0);
    for (std::vector<int>& column : columns_) {
      compact(column);
      p.row_index.insert(p.row_index.end(), column.begin(), column.end());
      p.column_start.push_back(static_cast<int>(p.row_index.size()));
      std::vector<int>().swap(column);
    }
    return p;
  }
  void finish(Model& model) {
    const int n = static_cast<int>(columns_.size());
    SparsePattern p = compressed();
    model.column_start = std::move(p.column_start);
    model.row_index = std::move(p.row_index);
    model_ = &model;
    model.diagonal.resize(n);
    for (int j = 0; j < n; ++j) model.diagonal[j] = position(j, j);
  }
  int position(int row, int column) const override {
    if (row < 0 || column < 0) return -1;
    const auto begin = model_->row_index.begin() + model_->column_start[column];
    const auto end = model_->row_index.begin() + model_->column_start[column + 1];
    const auto it = std::lower_bound(begin, end, row);
    return it != end && *it == row ? static_cast<int>(it - model_->row_index.begin()) : -1;
  }

 private:
  static void compact(std::vector<int>& column) {
    std::sort(column.begin(), column.end());
    column.erase(std::unique(column.begin(), column.end()), column.end());
  }
  std::vector<std::vector<int>> columns_;
  const Model* model_ = nullptr;
};

/// Gives every owner its unknowns in the documented order: nodes by type, then elements by family.
void number_unknowns(Model& model) {
  int n = 0;
  const auto add_unknowns = [&](int count, UnknownKind kind, double scale) {
    n += count;
    model.kinds.resize(n, kind);
    model.row_scale.resize(n, scale);
    model.is_constraint_row.resize(n, 0);
  };
  for (StructuralNode& node : model.structural) {
    if (node.is_dummy()) continue;
    node.first = n;
    node.equilibrium = n + node.unknowns() - node.position_unknowns();
    add_unknowns(node.unknowns(), UnknownKind::differential, node.scale);
  }
  for (const StructuralNode& node : model.structural)
    model.places.push_back({node.first, node.equilibrium, node.position_unknowns()});
  for (const ScalarKind kind :
       {ScalarKind::electric, ScalarKind::thermal, ScalarKind::abstract, ScalarKind::hydraulic})
    for (ScalarNode& node : model.scalars) {
      if (node.kind != kind) continue;
      node.unknown = n;
      add_unknowns(1, node.differential ? UnknownKind::differential : UnknownKind::algebraic,
                   node.scale);
    }
  for (int family = 0; family < kFamilies; ++family)
    for (const ElementRef& e : model.elements) {
      if (static_cast<int>(e.set->info(e.index).family) != family) continue;
      const int own = e.set->unknowns(e.index);
      for (int k = 0; k < own; ++k) {
        const bool differential = e.set->is_differential(e.index, k);
        add_unknowns(1, differential ? UnknownKind::differential : UnknownKind::algebraic,
                     model.family_scale[family]);
        model.is_constraint_row.back() = !differential;
      }
      set_of(model, e).bind(model, e.index, n - own);
    }
  model.unknowns = n;
}

/// A state of numbers without meaning, all elements active.
State meaningless_state(const Model& model, std::mt19937& generator) {
  const auto number = [&] { return 0.25 + generator() * 0x1p-32; };  // in [0.25, 1.25)
  const auto vector = [&] {
    const double x = number(), y = number();
    return Vec3(x, y, number());
  };
  State state;
  state.y.resize(model.unknowns);
  state.yp.resize(model.unknowns);
  for (double& y : state.y) y = number();
  for (double& yp : state.yp) yp = number();
  state.rotation.resize(model.structural.size());
  for (NodeRotation& r : state.rotation) {
    r = {rotation_of_vector<double>(vector()), vector()};
    state.rotation_history.emplace_back(r);
  }
  state.memory = model.initial_memory;
  state.variables = model.initial_variables;
  for (const ElementRef& e : model.elements)
    if (const int m = e.set->info(e.index).active_memory; m >= 0) state.memory[m] = 1;
  return state;
}

/// Lets every set find which entries of its matrices vanish at states without meaning. The
/// generator is always the same, hence so is the pattern of a deck.
void find_structure(Model& model) {
  std::mt19937 generator(20260101);
  const State states[] = {meaningless_state(model, generator), meaningless_state(model, generator)};
  Scratch scratch(model.scratch);
  for (double& sum : scratch.sums) sum = 0.25 + generator() * 0x1p-32;
  std::vector<StructureProbe> probes;
  for (const State& state : states) {
    StructureProbe probe;
    probe.context.model = &model;
    probe.context.state = &state;
    probe.context.scratch = &scratch;
    probe.context.time = model.initial_value.initial_time;
    probe.context.c = probe.context.seed = 0.375;
    probe.context.uniform_gravity = Vec3(0.5, 0.75, -1.25);
    for (const NodeRotation& r : state.rotation)
      probe.seeds.push_back({r.R + Mat3::Constant(0.125), r.R.transpose() + Mat3::Constant(0.625)});
    probes.push_back(std::move(probe));
  }
  for (auto& set : model.sets) set->find_structure(probes);
}

/// All elements by the rank of their family; those of one rank in the order of their sets.
void order_stages(Model& model) {
  for (const StageRank rank : {StageRank::contributor, StageRank::collector})
    for (const auto& owned : model.sets) {
      const ElementSet& set = *owned;
      const auto has_rank = [&](int i) { return family_facts(set.info(i).family).rank == rank; };
      for (int first = 0, last; first < set.size(); first = last + 1) {
        for (last = first; last < set.size() && has_rank(last);) ++last;
        if (last == first) continue;
        bool apart = true;
        for (int i = first; apart && i < last; ++i) apart = set.stages_apart(i);
        model.stage_order.push_back({&set, {first, last}, apart});
        if (set.accumulates()) model.accumulation.push_back(model.stage_order.back());
      }
    }
}

}  // namespace

Result<ModelPtr> ModelBuilder::finish() {
  Model& model = *model_;
  number_unknowns(model);
  model.node_equations.bind(model.structural);
  const auto collect = [&](Pattern& pattern) {
    model.node_equations.collect_pattern(pattern);
    for (const auto& set : model.sets) set->collect_pattern(pattern);
  };
  for (auto& set : model.sets) set->find_structure({});
  Pattern couplings(model.unknowns);
  collect(couplings);
  model.couplings = couplings.compressed();
  find_structure(model);
  Pattern pattern(model.unknowns);
  collect(pattern);
  pattern.finish(model);
  model.node_equations.set_positions(pattern);
  for (auto& set : model.sets) set->set_positions(pattern);
  model.node_bodies.resize(model.structural.size());
  for (const ElementRef& e : model.elements)
    if (e.set->info(e.index).family == Family::body)
      for (const int node : e.set->nodes(e.index)) model.node_bodies[node].push_back(e);
  for (const ElementRef& e : model.elements) {
    if (e.set->info(e.index).driven) model.driven.push_back(e);
    if (e.set->info(e.index).output) model.printed.push_back(e);
  }
  order_stages(model);
  model.assembly = AssemblyPlan(model);
  sets_.clear();
  return ModelPtr(std::move(model_));
}

}  // namespace mbcosim
