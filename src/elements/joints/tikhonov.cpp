#include "elements/joints/tikhonov.h"

#include "model/card.h"
#include "model/model.h"

namespace mbcosim {

void TikhonovSet::add(ElementInfo info, ElementRef joint, std::vector<double> coefficients) {
  slots_.push_back({std::move(info), joint, std::move(coefficients), {}, {}});
}

void TikhonovSet::bind(const Model&, int i, int) {
  Slot& s = slots_[i];
  const int first = s.joint.set->first_own(s.joint.index),
            count = s.joint.set->unknowns(s.joint.index);
  for (int k = 0; k < count; ++k)
    if (!s.joint.set->is_differential(s.joint.index, k)) s.rows.push_back(first + k);
}

void TikhonovSet::collect_pattern(PatternSink& sink) const {
  for (const Slot& s : slots_)
    for (const int row : s.rows) sink.block(&row, 1, &row, 1);
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
    if (!s.joint.set->is_active(*context.state, s.joint.index)) continue;
    for (std::size_t k = 0; k < s.rows.size(); ++k)
      r[s.rows[k]] -= s.epsilon[k] * context.state->y[s.rows[k]];
  }
}

void TikhonovSet::jacobian(const EvalContext& context, const NodeSeeds*, double* values,
                           ElementRange range) const {
  for (int i = range.first; i < range.last; ++i) {
    const Slot& s = slots_[i];
    if (!s.joint.set->is_active(*context.state, s.joint.index)) continue;
    for (std::size_t k = 0; k < s.positions.size(); ++k) values[s.positions[k]] += s.epsilon[k];
  }
}

void TikhonovSet::assembly_residual(const EvalContext& context, int i, double* r,
                                    double* r_rate) const {
  const Slot& s = slots_[i];
  if (!s.joint.set->is_active(*context.state, s.joint.index)) return;
  for (std::size_t k = 0; k < s.rows.size(); ++k) {
    r[s.rows[k]] -= s.epsilon[k] * context.state->y[s.rows[k]];
    r_rate[s.rows[k]] -= s.epsilon[k] * context.state->yp[s.rows[k]];
  }
}

void TikhonovSet::assembly_jacobian(const EvalContext& context, int i, int n,
                                    std::vector<Triplet>& out) const {
  const Slot& s = slots_[i];
  if (!s.joint.set->is_active(*context.state, s.joint.index)) return;
  for (std::size_t k = 0; k < s.rows.size(); ++k) {
    out.push_back({s.rows[k], s.rows[k], s.epsilon[k]});
    out.push_back({n + s.rows[k], n + s.rows[k], s.epsilon[k]});
  }
}

namespace {

void read_tikhonov(Card& card, ElementInfo& info) {
  const ElementRef joint = card.model().find_element(Family::joint, info.label);
  if (!joint.set)
    card.fail_undefined(
        card.last(), "joint", info.label,
        "the label of a regularization is that of its joint, which must stand before it");
  int count = 0;
  for (int k = 0; k < joint.set->unknowns(joint.index); ++k)
    count += !joint.set->is_differential(joint.index, k);
  if (count == 0)
    card.fail("joint regularization: joint " + std::to_string(info.label) + " has no constraints");
  std::vector<double> epsilon(count);
  if (card.keyword("list")) {
    for (double& e : epsilon) e = card.real("regularization coefficient");
  } else {
    std::fill(epsilon.begin(), epsilon.end(), card.real("regularization coefficient"));
  }
  for (const double e : epsilon)
    if (!(e >= 0))
      card.fail("regularization coefficient must not be negative, got " + std::to_string(e));
  TikhonovSet& set = card.builder().set<TikhonovSet>();
  set.add(info, joint, std::move(epsilon));
  card.builder().register_element(set);
}

}  // namespace

void register_tikhonov(Registry& registry) {
  registry.typed("joint regularization", Family::joint_regularization, {"tikhonov"}, read_tikhonov);
}

}  // namespace mbcosim
