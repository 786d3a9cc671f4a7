#include "elements/joints/clamp.h"

#include "elements/joints/joint_tangent.h"

namespace mbcosim {

void Clamp::tangent(const Local<double>& u, Tangent& t) const {
  const Mat3 rotation = relative_rotation<double>(u.R(0).transpose(), R0.transpose());
  for (int part = 0; part < 2; ++part)
    t.block(t.row_node(0) + 3 * part, t.col_own(3 * part)) += Mat3::Identity();
  t.add_position(t.row_own(0), 0, -Mat3::Identity() / u.c());
  t.add_orientation(t.row_own(3), 0, -inverse_gamma(vector_of_rotation(rotation)) / u.c());
}

void Clamp::start(Start& s) const {
  for (int i = 0; i < 3; ++i) {
    s.own(i) = F0(i);
    s.own(3 + i) = M0(i);
  }
}

void Clamp::output(const Local<double>& u, OutputRow& row) const {
  const Vec3 F = u.own3(0), M = u.own3(3);
  const Mat3 Rt = u.R(0).transpose();
  row.begin(OutputFile::jnt, u.label());
  row.reactions(Rt * F, Rt * M, F, M);
  row.end();
}

std::string Clamp::log(const Model& model, int label) const {
  const Attachment at{node, Vec3::Zero(), Mat3::Identity()};
  return LogLine("clamp", label).add(model, at).add(model, at).str();
}

void read_clamp(Card& card, ElementInfo& info) {
  Clamp e;
  e.node = read_attachment(card).node;
  const StructuralNode& node = card.model().structural[e.node];
  card.keyword("position");
  e.X0 = card.keyword("node") ? node.x : card.absolute_position("position", e.node);
  card.one_of({"orientation", "hinge"});
  e.R0 = card.keyword("node") ? node.R : card.absolute_orientation("orientation", e.node);
  if (card.keyword("initial state")) {
    e.F0 = card.vec3("initial force");
    e.M0 = card.vec3("initial moment");
  }
  add_element(card.builder(), info, e);
}

}  // namespace mbcosim
