#include "elements/joints/universal.h"

namespace mbcosim {

namespace {

void check_axes(Card& card, const TwoAttachments& e, const char* joint) {
  const Model& model = card.model();
  require_not_parallel(card, (model.structural[e.a.node].R * e.a.Rh).col(2),
                       (model.structural[e.b.node].R * e.b.Rh).col(1), joint);
}

Vec3 moment_direction(const TwoAttachments& e, const Local<double>& u) {
  return Vec3(e.hinge_b(u).col(1)).cross(Vec3(e.hinge_a(u).col(2)));
}

void read_hinges(Card& card, TwoAttachments& e) {
  e.a = read_attachment(card);
  read_optional_offset(card, e.a);
  read_optional_hinge(card, e.a);
  e.b = read_attachment(card);
  read_optional_offset(card, e.b, &e.a);
  read_optional_hinge(card, e.b, &e.a);
}

std::string log_orientations(const char* type, const TwoAttachments& e, const Model& model,
                             int label) {
  const Attachment first{e.a.node, Vec3::Zero(), e.a.Rh}, second{e.b.node, Vec3::Zero(), e.b.Rh};
  return LogLine(type, label).add(model, first).add(model, second).str();
}

}  // namespace

// ------------------------------------------------------------------ cardano hinge

void CardanoHinge::output(const Local<double>& u, OutputRow& row) const {
  const Vec3 F = u.own3(0);
  row.begin(OutputFile::jnt, u.label());
  row.reactions(hinge_a(u).transpose() * F, Vec3(u.own(3), 0, 0), F,
                moment_direction(*this, u) * u.own(3));
  row.orientation("E", relative_rotation(u).transpose(), OrientationDescription::euler123);
  row.end();
}

void read_cardano_hinge(Card& card, ElementInfo& info) {
  CardanoHinge e;
  e.a = read_point_and_hinge(card);
  e.b = read_point_and_hinge(card, &e.a);
  check_axes(card, e, "cardano hinge");
  add_element(card.builder(), info, e);
}

// ------------------------------------------------------------------ cardano rotation

void CardanoRotation::output(const Local<double>& u, OutputRow& row) const {
  row.begin(OutputFile::jnt, u.label());
  row.reactions(Vec3::Zero(), Vec3(u.own(0), 0, 0), Vec3::Zero(),
                moment_direction(*this, u) * u.own(0));
  row.orientation("E", relative_rotation(u).transpose(), description);
  row.end();
}

std::string CardanoRotation::log(const Model& model, int label) const {
  return log_orientations("cardanorotation", *this, model, label);
}

void read_cardano_rotation(Card& card, ElementInfo& info) {
  CardanoRotation e;
  read_hinges(card, e);
  check_axes(card, e, "cardano rotation");
  e.description = read_description(card);
  add_element(card.builder(), info, e);
}

// ------------------------------------------------------------------ cardano pin

void CardanoPin::output(const Local<double>& u, OutputRow& row) const {
  const Mat3 H = u.R(0) * a.Rh;
  const Vec3 F = u.own3(0), direction = Vec3(H.col(1)).cross(Vec3(R0.col(2)));
  row.begin(OutputFile::jnt, u.label());
  row.reactions(H.transpose() * F, Vec3(u.own(3), 0, 0), F, direction * u.own(3));
  row.orientation("E", R0.transpose() * H, OrientationDescription::euler123);
  row.end();
}

std::string CardanoPin::log(const Model& model, int label) const {
  return LogLine("cardanopin", label).add(model, a).pin(model, a.node, X0, R0).str();
}

void read_cardano_pin(Card& card, ElementInfo& info) {
  CardanoPin e;
  e.a = read_point_and_hinge(card);
  card.keyword("position");
  e.X0 = card.absolute_position("pin position");
  if (card.one_of({"hinge", "orientation"}) >= 0)
    e.R0 = card.absolute_orientation("pin orientation");
  require_not_parallel(card, e.R0.col(2), (card.model().structural[e.a.node].R * e.a.Rh).col(1),
                       "cardano pin");
  add_element(card.builder(), info, e);
}

// ------------------------------------------------------------------ gimbal rotation

void GimbalRotation::output(const Local<double>& u, OutputRow& row) const {
  const Vec3 M = u.own3(0);
  row.begin(OutputFile::jnt, u.label());
  row.reactions(Vec3::Zero(), M, Vec3::Zero(), u.R(0) * M);
  row.scalar("theta", "rad", u.own(3));
  row.scalar("phi", "rad", u.own(4));
  row.orientation("E", u.R(0).transpose() * u.R(1), description);
  row.end();
}

std::string GimbalRotation::log(const Model& model, int label) const {
  return log_orientations("gimbalrotation", *this, model, label);
}

void read_gimbal_rotation(Card& card, ElementInfo& info) {
  GimbalRotation e;
  read_hinges(card, e);
  e.description = read_description(card);
  add_element(card.builder(), info, e);
}

}  // namespace mbcosim
