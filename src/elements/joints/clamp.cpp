#include "elements/joints/clamp.h"

namespace mbcosim {

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
