#include <algorithm>

#include "model/model.h"

namespace mbcosim {

ModelBuilder::ModelBuilder() : model_(std::make_unique<Model>()) {}

int ModelBuilder::add_structural(StructuralNode node) {
  const int index = static_cast<int>(model_->structural.size());
  model_->structural_index.emplace(node.label, index);
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
  if (info.driven) {
    info.active_memory = allocate_memory(1, 1);
    model_->has_driven = true;
  }
  model_->elements.push_back(ref);
  model_->element_index[static_cast<int>(info.family)].emplace(info.label, ref);
  return ref;
}

int ModelBuilder::allocate_memory(int count, double initial) {
  const int offset = static_cast<int>(model_->initial_memory.size());
  model_->initial_memory.resize(offset + count, initial);
  return offset;
}

const EvalContext& ModelBuilder::input_context() {
  input_state_.time = model_->initial_value.initial_time;
  if (input_state_.memory.size() != model_->initial_memory.size())
    input_state_.memory = model_->initial_memory;
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
  void finish(Model& model) {
    const int n = static_cast<int>(columns_.size());
    model.column_start.assign(n + 1, 0);
    model.row_index.clear();
    for (int j = 0; j < n; ++j) {
      compact(columns_[j]);
      model.row_index.insert(model.row_index.end(), columns_[j].begin(), columns_[j].end());
      model.column_start[j + 1] = static_cast<int>(model.row_index.size());
      std::vector<int>().swap(columns_[j]);
    }
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
  const auto take = [&](int count, UnknownKind kind, double scale) {
    n += count;
    model.kinds.resize(n, kind);
    model.row_scale.resize(n, scale);
    model.is_constraint_row.resize(n, 0);
  };
  for (StructuralNode& node : model.structural) {
    if (node.is_dummy()) continue;
    node.first = n;
    node.equilibrium = n + node.unknowns() - node.position_unknowns();
    take(node.unknowns(), UnknownKind::differential, node.scale);
  }
  for (const ScalarKind kind :
       {ScalarKind::electric, ScalarKind::thermal, ScalarKind::abstract, ScalarKind::hydraulic})
    for (ScalarNode& node : model.scalars) {
      if (node.kind != kind) continue;
      node.unknown = n;
      take(1, node.differential ? UnknownKind::differential : UnknownKind::algebraic, node.scale);
    }
  for (int family = 0; family < static_cast<int>(Family::count); ++family)
    for (const ElementRef& e : model.elements) {
      if (static_cast<int>(e.set->info(e.index).family) != family) continue;
      const int own = e.set->unknowns(e.index);
      for (int k = 0; k < own; ++k) {
        const bool differential = e.set->is_differential(e.index, k);
        take(1, differential ? UnknownKind::differential : UnknownKind::algebraic,
             model.family_scale[family]);
        model.is_constraint_row.back() = !differential;
      }
      e.set->bind(model, e.index, n - own);
    }
  model.unknowns = n;
}

}  // namespace

Result<ModelPtr> ModelBuilder::finish() {
  Model& model = *model_;
  number_unknowns(model);
  model.node_equations.bind(model.structural);
  Pattern pattern(model.unknowns);
  model.node_equations.collect_pattern(pattern);
  for (const auto& set : model.sets) set->collect_pattern(pattern);
  pattern.finish(model);
  model.node_equations.set_positions(pattern);
  for (const auto& set : model.sets) set->set_positions(pattern);
  model.node_bodies.resize(model.structural.size());
  for (const ElementRef& e : model.elements)
    if (e.set->info(e.index).family == Family::body)
      for (const int node : e.set->nodes(e.index)) model.node_bodies[node].push_back(e);
  sets_.clear();
  return ModelPtr(std::move(model_));
}

}  // namespace mbcosim
