#include "elements/general_element.h"

#include <algorithm>
#include <utility>

namespace mbcosim {

int GeneralConnection::add_node(int structural_node, bool whole) {
  for (const Entry& e : entries_)
    if (e.index == structural_node && e.kind == (whole ? Entry::whole_node : Entry::node))
      return e.first;
  const int first = size_;
  entries_.push_back({whole ? Entry::whole_node : Entry::node, structural_node, first});
  size_ += whole ? builder_->model().structural[structural_node].unknowns() : 6;
  return first;
}

int GeneralConnection::scalar(int scalar_node) {
  for (const Entry& e : entries_)
    if (e.kind == Entry::scalar && e.index == scalar_node) return e.first;
  entries_.push_back({Entry::scalar, scalar_node, size_});
  return size_++;
}

int GeneralConnection::dof(const NodeDof& dof) {
  if (!dof.structural) return scalar(dof.node);
  return (dof.component < 6 ? node(dof.node) : whole_node(dof.node)) + dof.component;
}

int GeneralConnection::own(int count, bool differential) {
  const int first = size_;
  for (int i = 0; i < count; ++i) {
    entries_.push_back({Entry::own, static_cast<int>(own_differential_.size()), size_++});
    own_differential_.push_back(differential);
  }
  return first;
}

int GeneralConnection::memory(int count, double initial) {
  const int offset = builder_->allocate_memory(count, initial);
  if (memory_ < 0) memory_ = offset;
  memory_count_ += count;
  return offset - memory_;
}

int GeneralConnection::scratch(int count) {
  const int offset = scratch_count_;
  scratch_count_ += count;
  builder_->require_scratch(scratch_count_);
  return offset;
}

int GeneralConnection::column_of(const Model& model, const NodeDof& dof) {
  const auto find_or_append = [&](int first, int count, int size) {
    const auto known = std::find(columns_.begin(), columns_.end(), first);
    if (known != columns_.end()) return static_cast<int>(known - columns_.begin());
    for (int k = 0; k < size; ++k) columns_.push_back(k < count ? first + k : -1);
    return std::exchange(size_, size_ + size);
  };
  if (!model.has_column(dof)) return -1;
  if (!dof.structural) return find_or_append(model.scalars[dof.node].unknown, 1, 1);
  const StructuralNode& node = model.structural[dof.node];
  return find_or_append(node.first, node.position_unknowns(), 6) + dof.component;
}

void GeneralConnection::find_followed(const Model& model) {
  for (Followed& followed : followed_) {
    followed.drive->collect_followed(followed.dofs);
    if (followed.dofs.size() > kMaxFollowed) followed.dofs.clear();
    for (const NodeDof& dof : followed.dofs) followed.columns.push_back(column_of(model, dof));
  }
  rows_.resize(size_, -1);
  parameter_.resize(size_, -1);
}

Vec3 GeneralView::g(int structural_node) const {
  const double* y = &state().y[model().structural[structural_node].first + 3];
  return Vec3(y[0], y[1], y[2]);
}

Vec3 GeneralView::gp(int structural_node) const {
  const double* yp = &state().yp[model().structural[structural_node].first + 3];
  return Vec3(yp[0], yp[1], yp[2]);
}

double GeneralView::value(int local) const {
  if (const int m = connection_.parameter_[local]; m >= 0) return state().memory[m];
  const int k = unknown(local);
  return k < 0 || context.phase == Phase::input ? 0.0 : state().y[k];
}

double GeneralView::rate(int local) const {
  const int k = unknown(local);
  return k < 0 || context.phase == Phase::input ? 0.0 : state().yp[k];
}

double GeneralJacobian::value_factor(int column) const {
  const int k = connection_.columns_[column];
  return k >= 0 && context_.model->kinds[k] == UnknownKind::algebraic ? 1.0 : context_.seed;
}

double GeneralJacobian::rate_factor(int column) const {
  const int k = connection_.columns_[column];
  return k >= 0 && context_.model->kinds[k] == UnknownKind::algebraic ? 0.0 : 1.0;
}

void GeneralJacobian::dof(int row, int column, const NodeDof& d, double dr) {
  if (d.order == 0) return value(row, column, dr);
  if (d.order != 1) return;
  if (!d.structural || d.component < 3 || d.component >= 6) return rate(row, column, dr);
  const int axis = d.component - 3, first = column - axis;
  for (int k = 0; k < 3; ++k) add(row, first + k, -dr * seeds_[d.node].B(axis, k));
}

void GeneralElementSet::add(ModelBuilder& builder, ElementInfo info,
                            std::unique_ptr<GeneralElement> element) {
  Slot s{std::move(element), std::move(info), GeneralConnection(builder), {}};
  s.element->connect(s.connection);
  s.connection.rows_.assign(s.connection.size_, -1);  // until bind: nothing has a number
  s.connection.columns_.assign(s.connection.size_, -1);
  s.connection.parameter_.assign(s.connection.size_, -1);
  for (const GeneralConnection::Entry& e : s.connection.entries_)
    if (e.kind == GeneralConnection::Entry::scalar)
      s.connection.parameter_[e.first] = builder.model().scalars[e.index].memory;
  slots_.push_back(std::move(s));
}

std::vector<int> GeneralElementSet::nodes(int i) const {
  std::vector<int> r;
  for (const GeneralConnection::Entry& e : slots_[i].connection.entries_)
    if (e.kind == GeneralConnection::Entry::node || e.kind == GeneralConnection::Entry::whole_node)
      r.push_back(e.index);
  return r;
}

void GeneralElementSet::bind(const Model& model, int i, int first_own) {
  GeneralConnection& c = slots_[i].connection;
  using Entry = GeneralConnection::Entry;
  c.first_own_ = first_own;
  for (const Entry& e : c.entries_) {
    if (e.kind == Entry::scalar) {
      c.rows_[e.first] = c.columns_[e.first] = model.scalars[e.index].unknown;
    } else if (e.kind == Entry::own) {
      c.rows_[e.first] = c.columns_[e.first] = first_own + e.index;
    } else {
      const StructuralNode& node = model.structural[e.index];
      const bool whole = e.kind == Entry::whole_node;
      const int count = whole ? node.unknowns() : node.position_unknowns();
      for (int k = 0; k < count; ++k) {
        c.rows_[e.first + k] = (whole ? node.first : node.equilibrium) + k;
        c.columns_[e.first + k] = node.first + k;
      }
    }
  }
  c.find_followed(model);
}

GeneralPattern GeneralElementSet::pattern_of(const Slot& slot) {
  const GeneralConnection& c = slot.connection;
  GeneralPattern pattern(c.size_);
  slot.element->pattern(pattern);
  for (const GeneralConnection::Entry& e : c.entries_)  // the diagonal of an inactive element
    if (e.kind == GeneralConnection::Entry::own) pattern.block(e.first, 1, e.first, 1);
  return pattern;
}

void GeneralElementSet::collect_pattern(PatternSink& sink) const {
  for (const Slot& s : slots_) {
    const GeneralConnection& c = s.connection;
    const GeneralPattern pattern = pattern_of(s);
    for (const GeneralPattern::Block& b : pattern.blocks())
      sink.block(&c.rows_[b.row], b.rows, &c.columns_[b.column], b.columns);
  }
}

void GeneralElementSet::append_rows(const Model&, int i, std::vector<int>& rows) const {
  const std::vector<int>& own = slots_[i].connection.rows_;
  rows.insert(rows.end(), own.begin(), own.end());
  slots_[i].element->other_rows(rows);
}

void GeneralElementSet::set_positions(const PositionSource& source) {
  for (Slot& s : slots_) {
    const GeneralConnection& c = s.connection;
    const GeneralPattern pattern = pattern_of(s);
    s.places = GeneralPlaces(c.size_, pattern.blocks(), [&](int i, int j) {
      return source.position(c.rows_[i], c.columns_[j]);
    });
  }
}

void GeneralElementSet::start(const EvalContext& context, State& state, int i) const {
  slots_[i].element->start(view(context, i), state);
}

void GeneralElementSet::residual(const EvalContext& context, double* r, ElementRange range) const {
  for (int i = range.first; i < range.last; ++i) {
    const GeneralConnection& c = slots_[i].connection;
    if (is_active(*context.state, i)) {
      GeneralResidual local(c.rows_, r);
      slots_[i].element->residual(view(context, i), local);
      continue;
    }
    const int last = c.first_own_ + static_cast<int>(c.own_differential_.size());
    for (int k = c.first_own_; k < last; ++k) r[k] -= context.state->y[k];
  }
}

void GeneralElementSet::jacobian(const EvalContext& context, const NodeSeeds* seeds, double* values,
                                 ElementRange range) const {
  for (int i = range.first; i < range.last; ++i) {
    const Slot& s = slots_[i];
    GeneralJacobian local(context, s.connection, seeds, s.places, values);
    if (is_active(*context.state, i)) {
      s.element->jacobian(view(context, i), local);
      continue;
    }
    for (const GeneralConnection::Entry& e : s.connection.entries_)
      if (e.kind == GeneralConnection::Entry::own) local.value(e.first, e.first, -1.0);
  }
}

void GeneralElementSet::after_predict(const EvalContext& context, State& state,
                                      ElementRange range) const {
  for (int i = range.first; i < range.last; ++i)
    if (is_active(state, i)) slots_[i].element->after_predict(view(context, i), state);
}

void GeneralElementSet::after_convergence(const EvalContext& context, State& state,
                                          ElementRange range) const {
  for (int i = range.first; i < range.last; ++i)
    if (is_active(state, i)) slots_[i].element->after_convergence(view(context, i), state);
}

void GeneralElementSet::assembly_residual(const EvalContext& context, int i, double* r,
                                          double* r_rate) const {
  const GeneralConnection& c = slots_[i].connection;
  GeneralResidual position(c.rows_, r), rate(c.rows_, r_rate);
  slots_[i].element->assembly_residual(view(context, i), position, rate);
}

/// Central differences on a copy of the state: the assembly is done once, before the first step.
void GeneralElementSet::assembly_jacobian(const EvalContext& context, int i, int n,
                                          std::vector<Triplet>& out) const {
  constexpr double kStep = 1e-6;
  const Slot& s = slots_[i];
  using Entry = GeneralConnection::Entry;
  State changed = *context.state;
  EvalContext c = context;
  c.state = &changed;
  std::vector<double> plus(2 * static_cast<std::size_t>(n)), minus(plus.size());
  const auto differentiate = [&](int column, auto&& change) {
    std::fill(plus.begin(), plus.end(), 0.0);
    std::fill(minus.begin(), minus.end(), 0.0);
    change(kStep);
    assembly_residual(c, i, plus.data(), plus.data() + n);
    changed = *context.state;
    change(-kStep);
    assembly_residual(c, i, minus.data(), minus.data() + n);
    changed = *context.state;
    for (const int row : s.connection.rows_) {
      if (row < 0) continue;
      for (const int r : {row, row + n})
        if (plus[r] != minus[r]) out.push_back({r, column, -(plus[r] - minus[r]) / (2 * kStep)});
    }
  };
  const auto unknown = [&](int k) {
    differentiate(k, [&](double e) { changed.y[k] += e; });
    differentiate(k + n, [&](double e) { changed.yp[k] += e; });
  };
  for (const Entry& e : s.connection.entries_) {
    if (e.kind == Entry::own) {
      unknown(s.connection.columns_[e.first]);
      continue;
    }
    if (e.kind == Entry::scalar) continue;
    const StructuralNode& node = context.model->structural[e.index];
    for (int k = 0; k < 3 && node.first >= 0; ++k) unknown(node.first + k);
    for (int k = 0; k < 3 && node.has_rotation(); ++k) {
      NodeRotation& rotation = changed.rotation[e.index];
      differentiate(node.first + 3 + k, [&](double d) {
        rotation.R = rotation_of_vector<double>(Vec3::Unit(k) * d) * rotation.R;
      });
      differentiate(node.first + 3 + k + n, [&](double d) { rotation.w(k) += d; });
    }
  }
}

void GeneralElementSet::output(const EvalContext& context, int i, OutputRow& row) const {
  slots_[i].element->output(view(context, i), row);
}

std::string GeneralElementSet::log_line(const Model& model, int i) const {
  return slots_[i].element->log(model, slots_[i].info.label);
}

double GeneralElementSet::private_value(const EvalContext& context, int i, int datum) const {
  return is_active(*context.state, i) ? slots_[i].element->private_value(view(context, i), datum)
                                      : 0.0;
}

void GeneralElementSet::add_inertia(const EvalContext& context, int i, int node,
                                    Inertia& inertia) const {
  slots_[i].element->add_inertia(view(context, i), node, inertia);
}

void GeneralElementSet::add_momentum(const EvalContext& context, int i, State& state) const {
  slots_[i].element->add_momentum(view(context, i), state);
}

std::vector<SampledTable> GeneralElementSet::sampled_tables() const {
  std::vector<SampledTable> tables;
  for (const Slot& s : slots_) {
    SampledTable table;
    if (!s.element->sampled_table(table)) continue;
    table.samples += s.connection.memory_;
    table.first += s.connection.memory_;
    tables.push_back(std::move(table));
  }
  return tables;
}

ElementRef add_general_element(ModelBuilder& builder, ElementInfo info,
                               std::unique_ptr<GeneralElement> element) {
  auto& set = builder.set<GeneralElementSet>();
  set.add(builder, std::move(info), std::move(element));
  return builder.register_element(set);
}

}  // namespace mbcosim
