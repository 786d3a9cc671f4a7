#include "elements/joints/total_equation.h"

namespace mbcosim {

void TotalEquation::assembly_residual(const Local<TimeDual>& u, Residual<TimeDual>& r) const {
  const TotalConstraint& c = equation.constraint;
  const auto m = equation.motion(u);
  const Vec<TimeDual> xd = u.drive(c.displacement), spin = m.spin - u.drive(c.angle);
  c.assembly_rows(u, r, m.position - xd, m.velocity - xd, rotation_error(u, m), spin);
  if (!reaction) return;
  Vec<TimeDual> force, moment;
  reaction->constraint.assembly_multipliers(u, force, moment);
  reaction->loads(r, reaction->motion(u, 2), force, moment, 2);
}

namespace {

void output_line(OutputRow& row, const TotalJoint::Motion<double>& m, const Vec3& force,
                 const Vec3& moment) {
  row.reactions(force, moment, m.P * force, m.Q1 * moment);
  row.vec3("X", "m", m.position);
  row.vec3("Theta", "rad", vector_of_rotation(m.rotation));
  row.vec3("V", "m/s", m.velocity);
  row.vec3("Omega", "rad/s", m.spin);
}

LogLine& log_nodes(LogLine& line, const Model& model, const TotalJoint& e) {
  line.node(model, e.first).add(e.f1).add(e.R1h).add(e.R1r);
  return line.node(model, e.second).add(e.f2).add(e.R2h).add(e.R2r);
}

}  // namespace

void TotalEquation::output(const Local<double>& u, OutputRow& row) const {
  row.begin(OutputFile::jnt, u.label());
  output_line(row, equation.motion(u), Vec3::Zero(), Vec3::Zero());
  row.end();
}

std::string TotalEquation::log(const Model& model, int label) const {
  LogLine line("totalequation", label);
  return log_nodes(line, model, equation).str();
}

void TotalReaction::output(const Local<double>& u, OutputRow& row) const {
  const double* multipliers = &u.context->state->y[equation.set->first_own(equation.index)];
  Vec3 force = Vec3::Zero(), moment = Vec3::Zero();
  for (int i = 0; i < 3; ++i)
    if (joint.constraint.translation[i] != TotalConstraint::Kind::free) force(i) = *multipliers++;
  for (int i = 0; i < 3; ++i)
    if (joint.constraint.rotation[i] != TotalConstraint::Kind::free) moment(i) = *multipliers++;
  row.begin(OutputFile::jnt, u.label());
  output_line(row, joint.motion(u), force, moment);
  row.end();
}

std::string TotalReaction::log(const Model& model, int label) const {
  LogLine line("totalreaction", label);
  return log_nodes(line, model, joint).add(equation_label).str();
}

void read_total_equation(Card& card, ElementInfo& info) {
  TotalEquation e;
  read_total_nodes(card, e.equation);
  e.equation.constraint = read_total_constraint(card, e.equation);
  add_element(card.builder(), info, e);
}

void read_total_reaction(Card& card, ElementInfo& info) {
  TotalReaction e;
  read_total_nodes(card, e.joint);
  e.joint.constraint = read_total_constraint(card, e.joint, false);
  if (!card.keyword("total equation"))
    card.fail_at(card.next(),
                 "total internal reaction: the equation whose multipliers act here is missing",
                 "end the card with `total equation, <label>`", "missing-argument");
  e.equation = card.element(Family::joint);
  auto& equations = card.builder().set<ElementSetOf<TotalEquation>>();
  if (e.equation.set != &equations)
    card.fail("total internal reaction: this joint is not a total equation",
              "give the label of a total equation");
  auto& slot = equations.slot(e.equation.index);
  if (slot.element.reaction)
    card.fail("total internal reaction: the equation has a reaction already");
  const int wanted = slot.element.equation.constraint.count(), found = e.joint.constraint.count();
  if (wanted != found)
    card.fail("total internal reaction: " + std::to_string(found) +
                  " components are active, but the equation constrains " + std::to_string(wanted),
              "activate the same number of components in both cards");
  e.equation_label = slot.info->label;
  slot.element.reaction = e.joint;
  Connector connector(slot.connection, card.builder());
  connector.distinct_node(e.joint.first);
  connector.distinct_node(e.joint.second);
  add_element(card.builder(), info, e);
}

}  // namespace mbcosim
