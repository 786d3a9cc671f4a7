#include "elements/genels/readers.h"
#include "elements/genels/scalar_genels.h"
#include "elements/genels/swashplate.h"
#include "elements/read_dof.h"

namespace mbcosim {

namespace {

void read_clamp(Card& card, ElementInfo& info) {
  GenelClamp e;
  e.dof = read_equation_dof(card, "clamp");
  e.d = card.drive("imposed value");
  add_element(card.builder(), info, std::move(e));
}

void refuse_same_dof(Card& card, const NodeDof& a, const NodeDof& b, const char* what) {
  if (a.structural == b.structural && a.node == b.node && a.component == b.component &&
      a.order == b.order)
    card.fail(std::string(what) + ": both degrees of freedom are the same");
}

void read_distance(Card& card, ElementInfo& info) {
  GenelDistance e;
  e.first = read_equation_dof(card, "distance");
  e.second = read_equation_dof(card, "distance");
  refuse_same_dof(card, e.first, e.second, "distance");
  e.d = card.drive("distance");
  add_element(card.builder(), info, std::move(e));
}

void read_spring(Card& card, ElementInfo& info) {
  GenelSpring e;
  e.first = read_equation_dof(card, "spring");
  e.second = read_equation_dof(card, "spring");
  refuse_same_dof(card, e.first, e.second, "spring");
  const SourceSpan law = card.next();
  e.law = card.law1();
  if (e.law->type() != LawType::elastic)
    card.fail_at(law, "spring: an elastic law is needed, this one depends on the rate");
  add_element(card.builder(), info, std::move(e));
}

/// A dof whose rate is an unknown, too.
NodeDof read_differential_dof(Card& card, const char* what) {
  const SourceSpan where = card.next();
  const NodeDof dof = read_value_dof(card, what);
  if (!dof.differential)
    card.fail_at(where, std::string(what) +
                            ": a differential degree of freedom is needed, this one is algebraic");
  return dof;
}

void read_spring_support(Card& card, ElementInfo& info) {
  GenelSpringSupport e;
  e.row_dof = e.dof = read_differential_dof(card, "spring support");
  e.law = card.law1();
  if (card.keyword("position")) {
    if (card.keyword("from node"))
      e.x0 = card.model().dof_value(card.builder().input_context(), e.dof);
    else
      e.x0 = card.real("position");
  }
  add_element(card.builder(), info, std::move(e));
}

void read_cross_spring_support(Card& card, ElementInfo& info) {
  GenelSpringSupport e;
  e.row_dof = read_equation_dof(card, "cross spring support");
  e.dof = read_differential_dof(card, "cross spring support");
  e.law = card.law1();
  add_element(card.builder(), info, std::move(e));
}

void read_mass(Card& card, ElementInfo& info) {
  GenelMass e;
  const SourceSpan where = card.next();
  e.dof = read_equation_dof(card, "mass");
  if (!e.dof.differential)
    card.fail_at(where, "mass: a differential degree of freedom is needed, this one is algebraic");
  e.m = card.drive("mass");
  add_element(card.builder(), info, std::move(e));
}

int read_differential_abstract(Card& card, const char* what) {
  const int node = card.scalar_node(ScalarKind::abstract);
  if (!card.model().scalars[node].differential)
    card.fail(std::string(what) + ": abstract node " +
              std::to_string(card.model().scalars[node].label) + " must be differential");
  return node;
}

void read_swashplate(Card& card, ElementInfo& info) {
  Swashplate e;
  for (Swashplate::Input& input : e.inputs) {
    input.node = read_differential_abstract(card, "swashplate");
    if (!card.keyword("limits")) continue;
    input.least = card.real("lower limit");
    input.most = card.real("upper limit");
    if (input.most < input.least) card.fail("swashplate: the upper limit is below the lower one");
  }
  for (int& node : e.actuators) node = read_differential_abstract(card, "swashplate");
  if (card.more() && card.peek_word() != "output") {
    e.tau = card.real("time constant");
    if (e.tau < 0) card.fail("swashplate: the time constant must not be negative");
    if (card.more() && card.peek_word() != "output") {
      e.cyclic = card.real("cyclic factor");
      e.collective = card.real("collective factor");
    }
  }
  add_element(card.builder(), info, std::move(e));
}

}  // namespace

void register_scalar_genels(Registry& registry) {
  const auto genel = [&](std::initializer_list<std::string_view> words,
                         Registry::ElementReader reader) {
    registry.typed("genel", Family::genel, words, std::move(reader));
  };
  genel({"clamp"}, read_clamp);
  genel({"distance"}, read_distance);
  genel({"spring"}, read_spring);
  genel({"spring support"}, read_spring_support);
  genel({"cross spring support"}, read_cross_spring_support);
  genel({"mass"}, read_mass);
  genel({"swash plate"}, read_swashplate);
  registry.unsupported("genel", "rotor trim", "trim of aerodynamic rotors");
}

}  // namespace mbcosim
