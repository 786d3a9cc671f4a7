#include "elements/joints/rod.h"

namespace mbcosim {

void Rod::output(const Local<double>& u, OutputRow& row) const {
  const Kinematics<double> k = kinematics(u);
  const double f = law_force(u)(0);
  const Vec3 direction = k.l / k.length;
  row.begin(OutputFile::jnt, u.label());
  row.reactions(Vec3(f, 0, 0), Vec3::Zero(), direction * f, Vec3::Zero());
  row.scalar("l", "m", k.length);
  row.vec3("v", "", direction);
  row.scalar("lP", "m/s", k.rate);
  output_law(u, row);
  row.end();
}

double Rod::own_datum(const Local<double>& u, int datum) const {
  if (datum == 0) return law_force(u)(0);
  const Kinematics<double> k = kinematics(u);
  return datum == 1 ? k.length : k.rate;
}

namespace {

/// `{ <L0> | from nodes }`, with the points known.
void read_length(Card& card, Rod& e, double initial) {
  if (card.keyword("from nodes")) {
    e.L0 = initial;
  } else {
    e.L0 = card.real("length");
    if (!(e.L0 > 0))
      card.fail("rod: the unstressed length must be positive",
                "give a positive length or `from nodes`");
  }
}

void finish(Card& card, ElementInfo& info, Rod& e, double initial) {
  if (!(initial > 0))
    card.fail("rod: the two points coincide", "a rod needs a length at the start");
  card.set_current("L0", e.L0);
  card.set_current("L", initial);
  e.law = card.law1();
  add_element(card.builder(), info, e);
}

double initial_length(Card& card, const Rod& e) {
  return (input_point(card.model(), e.b) - input_point(card.model(), e.a)).norm();
}

}  // namespace

void read_rod(Card& card, ElementInfo& info) {
  Rod e;
  e.a = read_attachment(card, true);
  read_optional_offset(card, e.a);
  e.b = read_attachment(card, true);
  read_optional_offset(card, e.b, &e.a);
  const bool from_nodes = card.peek_word() == "from nodes" || card.peek_word() == "fromnodes";
  read_length(card, e, initial_length(card, e));
  if (card.keyword("offset")) {
    for (Attachment* at : {&e.a, &e.b}) {
      if (card.model().structural[at->node].is_displacement())
        card.fail("rod: an offset needs a node with an orientation",
                  "leave out `offset` or use a static or dynamic node");
      at->f = card.relative_position("offset", at->node);
    }
    if (from_nodes) e.L0 = initial_length(card, e);
  }
  finish(card, info, e, initial_length(card, e));
}

void read_rod_with_offset(Card& card, ElementInfo& info) {
  Rod e;
  e.a = read_attachment(card);
  read_offset(card, e.a);
  e.b = read_attachment(card);
  read_offset(card, e.b, &e.a);
  const double initial = initial_length(card, e);
  read_length(card, e, initial);
  finish(card, info, e, initial);
}

}  // namespace mbcosim
