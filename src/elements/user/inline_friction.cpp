#include "elements/user/inline_friction.h"

#include "elements/read_number.h"

namespace mbcosim {

namespace {

constexpr const char* kFrictionGrammar =
    "inline friction, node1, <node> [, offset, <position>] [, hinge, <orientation>], node2, <node> "
    "[, offset, <position>], [coulomb friction coefficient, <muc> [, static friction coefficient, "
    "<mus>] [, sliding velocity coefficient, <vs>] [, sliding velocity exponent, <i>], micro slip "
    "displacement, <delta> [, initial stiction state, <z0>] [, initial stiction derivative, "
    "<zP0>]] "
    "[, viscous friction coefficient, <kv>] [, stiction state equation scale, <s>]";

double read_not_negative(Card& card, const char* what) {
  const double value = card.real(what);
  if (!(value >= 0) || !std::isfinite(value))
    card.fail(std::string("the ") + what + " must not be negative, got " + std::to_string(value));
  return value;
}

void read_dry_friction(Card& card, InlineFriction& e) {
  e.coulomb = e.stiction = read_not_negative(card, "coulomb friction coefficient");
  if (card.keyword("static friction coefficient"))
    e.stiction = read_not_negative(card, "static friction coefficient");
  if (card.keyword("sliding velocity coefficient"))
    e.v_s = read_positive(card, "sliding velocity coefficient");
  if (card.keyword("sliding velocity exponent")) e.exponent = card.real("exponent");
  if (!card.keyword("micro slip displacement"))
    card.fail_expected("`micro slip displacement` expected after the friction coefficients");
  e.slip = read_positive(card, "micro slip displacement");
  if (card.keyword("initial stiction state")) {
    const double z = card.real("initial stiction state");
    if (!(std::abs(z) <= 1))
      card.fail("the initial stiction state must be between -1 and 1, got " + std::to_string(z));
    e.z0 = z * e.slip;
  }
  if (card.keyword("initial stiction derivative"))
    e.zp0 = card.real("initial stiction derivative") * e.slip;
}

}  // namespace

void InlineFriction::assembly_residual(const Local<TimeDual>& u, Residual<TimeDual>& r) const {
  guide(u, motion(u), TimeDual(0.0), r);
  if (dry()) r.own(2, TimeDual::variable(-u.own(2).v, 0, -u.own(2).d[0]));
}

void InlineFriction::start(Start& s) const {
  if (!dry()) return;
  s.own(2) = z0;
  s.own_rate(2) = zp0;
}

void InlineFriction::output(const Local<double>& u, OutputRow& row) const {
  row.begin(OutputFile::usr, u.label());
  row.scalar("lambda1", "N", u.own(0));
  row.scalar("lambda2", "N", u.own(1));
  row.scalar("z", "m", dry() ? u.own(2) : 0.0);
  row.scalar("zP", "m/s", dry() ? u.own_rate(2) : 0.0);
  row.end();
}

std::string InlineFriction::log(const Model& model, int label) const {
  std::ostringstream numbers;
  for (const double x : {coulomb, stiction, v_s, exponent, viscous, slip, z0, zp0})
    numbers << ' ' << x;
  return LogLine("inline friction", label).add(model, a).point(model, b).str() + numbers.str();
}

double InlineFriction::private_value(const Local<double>& u, int datum) const {
  const double v = motion(u).v;
  switch (datum) {
    case 0:
    case 1:
      return u.own(datum);
    case 2:
      return friction(u, v);
    case 3:
      return dry() ? coefficient(v) : 0.0;
    case 4:
      return dry() ? u.own(2) : 0.0;
    case 5:
      return dry() ? u.own_rate(2) : 0.0;
    case 6:
      return v;
    default:
      return -v * friction(u, v);
  }
}

void read_inline_friction(Card& card, ElementInfo& info) {
  read_help(card, kFrictionGrammar);
  InlineFriction e;
  if (!card.keyword("node1")) card.fail_expected("`node1` expected");
  e.a = read_attachment(card);
  if (card.keyword("offset")) e.a.f = card.relative_position("offset", e.a.node);
  read_optional_hinge(card, e.a);
  if (!card.keyword("node2")) card.fail_expected("`node2` expected");
  e.b = read_attachment(card);
  if (e.a.node == e.b.node) card.fail("both nodes are the same");
  if (card.keyword("offset")) e.b.f = card.relative_position("offset", e.b.node);
  if (card.keyword("coulomb friction coefficient")) read_dry_friction(card, e);
  if (card.keyword("viscous friction coefficient"))
    e.viscous = read_not_negative(card, "viscous friction coefficient");
  if (card.keyword("stiction state equation scale")) {
    e.scale = card.real("scale of the stiction state equation");
    if (e.scale == 0) card.fail("the scale of the stiction state equation must not be zero");
  }
  add_element(card.builder(), info, e);
}

}  // namespace mbcosim
