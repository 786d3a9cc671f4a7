#include "elements/user/asynchronous_machine.h"

#include "elements/read_number.h"

namespace mbcosim {

namespace {

constexpr const char* kMachineGrammar =
    "asynchronous_machine, rotor, <node>, stator, <node>, MK, <breakdown torque>, sK, <breakdown "
    "slip>, OmegaS, <synchronous speed> [, motor on, <drive>] [, M0, <torque>] [, MP0, <rate>]";

void expect(Card& card, const char* word) {
  if (!card.keyword(word)) card.fail_expected(std::string("`") + word + "` expected");
}

}  // namespace

void read_asynchronous_machine(Card& card, ElementInfo& info) {
  read_help(card, kMachineGrammar);
  AsynchronousMachine e;
  expect(card, "rotor");
  e.rotor = card.structural_node();
  expect(card, "stator");
  e.stator = card.structural_node();
  if (e.rotor == e.stator) card.fail("rotor and stator are the same node");
  expect(card, "MK");
  e.M_K = card.real("breakdown torque");
  expect(card, "sK");
  e.s_K = read_positive(card, "breakdown slip");
  expect(card, "OmegaS");
  e.synchronous = card.drive("synchronous speed");
  if (card.keyword("motor on")) e.on = card.drive("motor on");
  if (card.keyword("M0")) e.M0 = card.real("initial torque");
  if (card.keyword("MP0")) e.MP0 = card.real("initial rate of the torque");
  add_element(card.builder(), info, std::move(e));
}

}  // namespace mbcosim
