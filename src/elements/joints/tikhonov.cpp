#include "elements/joints/tikhonov.h"

#include "model/card.h"
#include "model/model.h"

namespace mbcosim {

void TikhonovSet::add(ElementInfo info, ElementRef joint, std::vector<double> coefficients,
                      bool matrix_only) {
  slots_.push_back({std::move(info), joint, std::move(coefficients), matrix_only, {}, {}, {}});
}

std::vector<double> TikhonovSet::coefficients(ElementRef joint) const {
  for (const Slot& s : slots_)
    if (s.joint.set == joint.set && s.joint.index == joint.index) return s.epsilon;
  return {};
}

void TikhonovSet::bind(const Model&, int i, int) {
  Slot& s = slots_[i];
  const int first = s.joint.set->first_own(s.joint.index),
            count = s.joint.set->unknowns(s.joint.index);
  for (int k = 0; k < count; ++k) {
    s.rows.push_back(first + k);
    s.differential.push_back(s.joint.set->is_differential(s.joint.index, k) ? 1 : 0);
  }
}

void TikhonovSet::collect_pattern(PatternSink& sink) const {
  for (const Slot& s : slots_)
    for (const int row : s.rows) sink.block(&row, 1, &row, 1);
}

void TikhonovSet::append_rows(const Model&, int i, std::vector<int>& rows) const {
  rows.insert(rows.end(), slots_[i].rows.begin(), slots_[i].rows.end());
}

void TikhonovSet::set_positions(const PositionSource& positions) {
  for (Slot& s : slots_) {
    s.positions.clear();
    for (const int row : s.rows) s.positions.push_back(positions.position(row, row));
  }
}

void TikhonovSet::residual(const EvalContext& context, double* r, ElementRange range) const {
  for (int i = range.first; i < range.last; ++i) {
    const Slot& s = slots_[i];
    if (s.matrix_only || !s.joint.set->is_active(*context.state, s.joint.index)) continue;
    for (std::size_t k = 0; k < s.rows.size(); ++k)
      r[s.rows[k]] += s.epsilon[k] * context.state->y[s.rows[k]] / context.c;
  }
}

void TikhonovSet::jacobian(const EvalContext& context, const NodeSeeds*, double* values,
                           ElementRange range) const {
  for (int i = range.first; i < range.last; ++i) {
    const Slot& s = slots_[i];
    if (!s.joint.set->is_active(*context.state, s.joint.index)) continue;
    for (std::size_t k = 0; k < s.positions.size(); ++k)
      values[s.positions[k]] -= s.epsilon[k] / context.c * (s.differential[k] ? context.seed : 1.0);
  }
}

void TikhonovSet::assembly_residual(const EvalContext& context, int i, double* r,
                                    double* r_rate) const {
  const Slot& s = slots_[i];
  if (s.matrix_only || !s.joint.set->is_active(*context.state, s.joint.index)) return;
  for (std::size_t k = 0; k < s.rows.size(); ++k) {
    r[s.rows[k]] += s.epsilon[k] * context.state->y[s.rows[k]];
    r_rate[s.rows[k]] += s.epsilon[k] * context.state->yp[s.rows[k]];
  }
}

void TikhonovSet::assembly_jacobian(const EvalContext& context, int i, int n,
                                    std::vector<Triplet>& out) const {
  const Slot& s = slots_[i];
  if (!s.joint.set->is_active(*context.state, s.joint.index)) return;
  for (std::size_t k = 0; k < s.rows.size(); ++k) {
    out.push_back({s.rows[k], s.rows[k], -s.epsilon[k]});
    out.push_back({n + s.rows[k], n + s.rows[k], -s.epsilon[k]});
  }
}

namespace {

constexpr double kDefaultEpsilon = 1e-6;

std::vector<double> read_coefficients(Card& card, int count) {
  std::vector<double> epsilon(count, kDefaultEpsilon);
  if (card.keyword("list"))
    for (double& e : epsilon) e = card.real("regularization coefficient");
  else if (card.more() && card.peek_word() != "output")
    std::fill(epsilon.begin(), epsilon.end(), card.real("regularization coefficient"));
  for (const double e : epsilon)
    if (!(e >= 0))
      card.fail("regularization coefficient must not be negative, got " + std::to_string(e));
  return epsilon;
}

void read_regularization(Card& card, ElementInfo& info, bool matrix_only) {
  const ElementRef joint = card.model().find_element(Family::joint, info.label);
  if (!joint.set)
    card.fail_undefined(
        card.last(), "joint", info.label,
        "the label of a regularization is that of its joint, which must stand before it");
  const int count = joint.set->unknowns(joint.index);
  if (count == 0)
    card.fail("joint regularization: joint " + std::to_string(info.label) + " has no constraints");
  TikhonovSet& set = card.builder().set<TikhonovSet>();
  set.add(info, joint, read_coefficients(card, count), matrix_only);
  card.builder().register_element(set);
}

}  // namespace

void register_tikhonov(Registry& registry) {
  const auto add = [&](std::string_view word, Registry::ElementReader reader) {
    registry.typed("joint regularization", Family::joint_regularization, {word}, std::move(reader));
  };
  add("tikhonov", [](Card& c, ElementInfo& info) { read_regularization(c, info, false); });
  add("dynamic", [](Card& c, ElementInfo& info) { read_regularization(c, info, false); });
  add("jacobian", [](Card& c, ElementInfo& info) { read_regularization(c, info, true); });
}

}  // namespace mbcosim
