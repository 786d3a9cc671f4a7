#include "elements/modal/modal_force.h"

#include "elements/modal/readers.h"
#include "model/card.h"
#include "model/output_row.h"

namespace mbcosim {

VecN<6> ModalForce::resultant(const EvalContext& context) const {
  VecN<6> r = VecN<6>::Zero();
  for (const Term& t : terms) {
    const double d = t.drive->value(context);
    r.head<3>() += d * t.f;
    r.tail<3>() += d * t.m;
  }
  return r;
}

std::vector<int> ModalForceSet::nodes(int i) const {
  const int node = slots_[i].force.node;
  return node >= 0 ? std::vector<int>{node} : std::vector<int>{};
}

bool ModalForceSet::orientation_block(const Slot& s, int rows[6], int columns[3]) const {
  if (s.force.node < 0) return false;
  const StructuralNode& node = (*structural_)[s.force.node];
  for (int k = 0; k < 6; ++k) rows[k] = node.equilibrium + k;
  for (int k = 0; k < 3; ++k) columns[k] = node.first + 3 + k;
  return true;
}

void ModalForceSet::collect_pattern(PatternSink& sink) const {
  int rows[6], columns[3];
  for (const Slot& s : slots_)
    if (orientation_block(s, rows, columns)) sink.block(rows, 6, columns, 3);
}

void ModalForceSet::append_rows(const Model& model, int i, std::vector<int>& rows) const {
  const ModalForce& force = slots_[i].force;
  const int first = force.joints->first_mode_row(force.joint);
  for (const ModalForce::Term& t : force.terms) rows.push_back(first + t.mode);
  if (force.node < 0) return;
  for (int k = 0; k < 6; ++k) rows.push_back(model.structural[force.node].equilibrium + k);
}

void ModalForceSet::set_positions(const PositionSource& positions) {
  int rows[6], columns[3];
  for (Slot& s : slots_) {
    s.positions.clear();
    if (!orientation_block(s, rows, columns)) continue;
    for (const int column : columns)
      for (const int row : rows) s.positions.push_back(positions.position(row, column));
  }
}

void ModalForceSet::residual(const EvalContext& context, double* r, ElementRange range) const {
  for (int i = range.first; i < range.last; ++i) {
    if (!is_active(*context.state, i)) continue;
    const ModalForce& force = slots_[i].force;
    const int first = force.joints->first_mode_row(force.joint);
    for (const ModalForce::Term& t : force.terms) r[first + t.mode] += t.drive->value(context);
    if (force.node < 0) continue;
    const VecN<6> local = force.resultant(context);
    const Mat3 R = context.model->node_state(context, force.node).R;
    const Vec3 f = R * local.head<3>(), m = R * local.tail<3>();
    const int row = (*structural_)[force.node].equilibrium;
    for (int k = 0; k < 3; ++k) {
      r[row + k] += f(k);
      r[row + 3 + k] += m(k);
    }
  }
}

void ModalForceSet::jacobian(const EvalContext& context, const NodeSeeds* seeds, double* values,
                             ElementRange range) const {
  for (int i = range.first; i < range.last; ++i) {
    const Slot& s = slots_[i];
    if (s.force.node < 0 || !is_active(*context.state, i)) continue;
    const VecN<6> local = s.force.resultant(context);
    const Mat3 R = context.model->node_state(context, s.force.node).R;
    Eigen::Matrix<double, 6, 3> block;
    block << cross<double>(R * local.head<3>()), cross<double>(R * local.tail<3>());
    block *= seeds[s.force.node].A;
    for (int k = 0; k < 18; ++k) values[s.positions[k]] += block(k % 6, k / 6);
  }
}

void ModalForceSet::output(const EvalContext& context, int i, OutputRow& row) const {
  const ModalForce& force = slots_[i].force;
  row.begin(OutputFile::frc, slots_[i].info.label);
  if (force.node >= 0) {
    const VecN<6> local = force.resultant(context);
    row.vec3("F", "N", local.head<3>());
    row.vec3("M", "N m", local.tail<3>());
  }
  for (const ModalForce::Term& t : force.terms) row.scalar("f", "", t.drive->value(context));
  row.end();
}

void read_modal_force(Card& card, ElementInfo& info) {
  ModalForce force;
  const ElementRef ref = card.element(Family::joint);
  force.joints = dynamic_cast<const ModalJointSet*>(ref.set);
  if (!force.joints)
    card.fail("modal force: joint " + std::to_string(ref.set->info(ref.index).label) +
              " is not a modal joint");
  force.joint = ref.index;
  const ModalJoint& joint = force.joints->joint(ref.index);
  force.node = joint.node;
  const int modes = joint.body->modes;
  force.terms.resize(modes);
  if (card.keyword("list")) {
    const int count = card.integer("number of modes");
    if (count < 1 || count > modes)
      card.fail("modal force: the number of modes must be 1 to " + std::to_string(modes) +
                ", got " + std::to_string(count));
    force.terms.resize(count);
    for (int k = 0; k < count; ++k) {
      const int number = card.integer("mode number");
      const int mode = joint.body->find_mode(number);
      if (mode < 0)
        card.fail("modal force: mode " + std::to_string(number) +
                  " is not one of the active modes");
      for (int other = 0; other < k; ++other)
        if (force.terms[other].mode == mode)
          card.fail("modal force: mode " + std::to_string(number) + " is listed twice");
      force.terms[k].mode = mode;
    }
  } else {
    for (int k = 0; k < modes; ++k) force.terms[k].mode = k;
  }
  for (ModalForce::Term& term : force.terms) {
    term.drive = card.drive("modal force");
    if (!card.keyword("resultant")) continue;
    if (joint.node < 0) card.fail("modal force: `resultant` needs a modal joint with a modal node");
    for (int k = 0; k < 3; ++k) term.f(k) = card.real("resultant force");
    for (int k = 0; k < 3; ++k) term.m(k) = card.real("resultant moment");
  }
  auto& set = card.builder().set<ModalForceSet>();
  set.add(info, std::move(force));
  card.builder().register_element(set);
}

}  // namespace mbcosim
