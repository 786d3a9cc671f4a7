/// What cards of modal bodies are refused for, and what is only warned of.
#include <gtest/gtest.h>

#include "elements/modal_deck.h"

namespace mbcosim::modal_refusal_test {
namespace {

using decks::ModalDeck;

const std::string kCard =
    "joint: 1, modal, 1, 2, 3, no damping, \"dynamic.fem\", 1, 1003, 2, null;";

ModalDeck deck_with(const std::string& card, double height = 0) {
  ModalDeck deck;
  deck.files = {{"dynamic.fem", write_fem_text(decks::hand_made(true), {})},
                {"static.fem", write_fem_text(decks::hand_made(false), {})}};
  deck.node(1, "modal");
  deck.node(2, "static", {Vec3(0, 2, height)});
  deck.joints = card + "\n";
  return deck;
}

/// kCard with one piece replaced.
std::string card(const std::string& from, const std::string& to) {
  std::string text = kCard;
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return at == std::string::npos ? text : text.replace(at, from.size(), to);
}

std::string findings(const ModalDeck& deck, Severity severity) {
  std::string all;
  for (const Diagnostic& d : load_deck(BundleSource(deck.bundle()), "deck.mbd").diagnostics)
    if (d.severity == severity) all += d.message + "\n";
  return all;
}
void expect_refused(const ModalDeck& deck, const std::string& part) {
  EXPECT_NE(findings(deck, Severity::error).find(part), std::string::npos)
      << deck.joints << "expected: " << part << "\nfound: " << findings(deck, Severity::error);
}
void expect_warned(const ModalDeck& deck, const std::string& part) {
  EXPECT_EQ(findings(deck, Severity::error), "") << deck.joints;
  EXPECT_NE(findings(deck, Severity::warning).find(part), std::string::npos)
      << deck.joints << "expected: " << part << "\nfound: " << findings(deck, Severity::warning);
}

TEST(ModalCard, NamesWhatItRefuses) {
  EXPECT_EQ(
      findings(deck_with(kCard), Severity::error) + findings(deck_with(kCard), Severity::warning),
      "");
  const std::pair<std::string, const char*> bad[] = {
      {card("modal, 1,", "modal, 2,"), "structural node 2 is not a modal node"},
      {card("modal, 1,", "modal, 7,"), "structural node 7 is not defined"},
      {card("1, 2, 3", "1, 0, 3"), "the number of modes must be at least 1, got 0"},
      {card("1, 2, 3", "1, 2, -3"), "the number of FEM nodes must be at least 1, got -3"},
      {card("1, 2, 3", "1, 3, 3"), "has 2 modes, but mode 3 is asked for"},
      {card("1, 2, 3", "1, 2, list, 2, 1, 3"),
       "the list of modes must be ascending, got 1 after 2"},
      {card("1, 2, 3", "1, 2, list, 1, 1, 3"), "mode 1 is listed twice"},
      {card("1, 2, 3", "1, 2, list, 0, 1, 3"), "mode numbers start at 1, got 0"},
      {card("1, 2, 3", "1, 1, list, 3, 3"), "has 2 modes, but mode 3 is asked for"},
      {card("1, 2, 3", "1, 1, list, 2, initial value, mode, 1, 0., 0., 3"),
       "mode 1 is not one of the active modes"},
      {card("1, 2, 3", "1, 2, initial value, mode, 3, 0., 0., 3"),
       "mode 3 is not one of the active modes"},
      {card("1, 2, 3", "1, 2, 4"), "announces 4 FEM nodes, but \"dynamic.fem\" has 3"},
      {card("no damping", "diag damping, 1, 3, .1"), "counts the active modes, 1 to 2; got 3"},
      {card("no damping", "diag damping, 2, 1, .1, 1, .1"),
       "the damping of active mode 1 is given twice"},
      {card("no damping", "diag damping, 3, 1, .1, 2, .1, 1, .1"),
       "the number of damped modes must be 1 to 2, got 3"},
      {card("dynamic.fem\"", "nowhere.fem\""), "cannot open \"nowhere.fem\""},
      {card("fem\"", "fem\", mass threshold, -1."), "a threshold must not be negative"},
      {card("fem\"", "fem\", origin node, \"77\""), "FEM node 77 is not in \"dynamic.fem\""},
      {card("1, 1003", "-1, 1003"), "the number of interface nodes must not be negative"},
      {card("1, 1003", "2, 1003"), "FEM node label missing"},
      {card("1, 1003", "1, 1004"), "FEM node 1004 is not in \"dynamic.fem\""},
      {card("1003, 2", "1003, 1"), "the modal node cannot be an interface node of its own body"},
      {card("1, 1003, 2, null", "2, 1003, 2, null, 1003, 2, null"), "appears twice"},
      {card("null", "null, 3."), "unexpected argument"},
      {"joint: 1, modal, 1, 2, 3, no damping, \"static.fem\", 1, 1003, 2, null, use invariant 9;",
       "`use invariant 9` needs record group 11"}};
  for (const auto& [text, message] : bad) expect_refused(deck_with(text), message);
}

/// Counts of the card size nothing before they are checked.
TEST(ModalCard, ChecksHugeCounts) {
  const std::pair<std::string, const char*> bad[] = {
      {card("1, 2, 3", "1, 2000000000, 3"), "has 2 modes, but mode 2000000000 is asked for"},
      {card("1, 2, 3, no damping", "1, 2000000000, 3, single factor damping, .1"),
       "mode 2000000000 is asked for"},
      {card("1, 2, 3, no damping", "1, 2000000000, 3, diag damping, 1, 2000000000, .1"),
       "mode 2000000000 is asked for"},
      {card("1, 2, 3", "1, 2000000000, initial value, mode, 2000000000, 0., 0., 3"),
       "mode 2000000000 is asked for"},
      {card("1, 2, 3", "1, 2, 2000000000"), "announces 2000000000 FEM nodes"},
      {card("1, 1003", "2000000000, 1003"),
       "2000000000 interface nodes, but the body has 3 FEM nodes"}};
  for (const auto& [text, message] : bad) expect_refused(deck_with(text), message);
}

TEST(ModalCard, WarnsOfWhatIsLikelyWrong) {
  expect_warned(deck_with(card("no damping, ", "")), "no damping keyword");
  expect_warned(deck_with(card("no damping", "proportional damping, .1")),
                "`proportional damping` is an old name");
  expect_warned(deck_with(card("no damping", "rayleigh damping, -1., 0.")),
                "negative damping factor");
  expect_warned(deck_with(card("1, 2, 3", "1, 1, 3")), "the first 1 of 2 modes are used");
  expect_warned(deck_with(card("1, 2, 3", "1, 2, initial value, 0., 0., 0., 0., 3")),
                "gives one pair to each mode in turn");
  expect_warned(deck_with(card("1, 2, 3", "1, 2, initial value, mode, 1, .1, 0., 3")),
                "relaxes the initial amplitudes");
  expect_warned(deck_with(card("fem\"", "fem\", use binary")), "no binary copy is written");
  expect_warned(deck_with(card("fem\"", "fem\", echo, \"x\", precision, 9")),
                "the echo of the FEM data is not written");
  expect_warned(deck_with(card("null", "null, \"old.mod\"")),
                "the file name at the end is an old form");
  expect_warned(deck_with(kCard, .1), "structural node 2 is 0.100000 m away from FEM node 1003");
  ModalDeck turned = deck_with(kCard);
  turned.nodes.clear();
  turned.node(1, "modal");
  turned.node(2, "static", {Vec3(0, 2, 0), rotation_of_vector<double>(Vec3(.1, 0, 0))});
  expect_warned(turned, "turned by 0.100000 rad against the floating frame");
}

TEST(ModalCard, WarnsOfMatricesThatSingleFactorDampingIgnores) {
  ModalDeck deck = deck_with("");
  FemData data = decks::hand_made(true);
  data.stiffness(0, 1) = data.stiffness(1, 0) = 3;
  deck.files["full.fem"] = write_fem_text(data, {});
  deck.joints =
      "joint: 1, modal, 1, 2, 3, single factor damping, .1, \"full.fem\", 1, 1003, 2, null;\n";
  expect_warned(deck, "diagonal");
  data.stiffness(1, 0) = -3;
  deck.files["full.fem"] = write_fem_text(data, {});
  expect_warned(deck, "symmetric");
  data.lumped.reset();
  data.rigid = FemRigidInertia{3, Vec3::Zero(), Vec3(-11, 3, 11).asDiagonal()};
  deck.files["full.fem"] = write_fem_text(data, {});
  expect_warned(deck, "indefinite");
}

TEST(ModalCard, AcceptsLabelsAsExpressionsAndOptionsInBothPlaces) {
  for (const std::string& text :
       {card("1003", "1000+3"), card("1003", "\"1003\""), card("1, 2, 3", "1, 2, from file"),
        card("null", "null, use invariant 9"), card("fem\"", "fem\", use invariant 9"),
        card("null", "null, hinge, eye, output, yes"), card("1, 1003", "1, output, yes, 1003"),
        card("fem\"", "fem\", threshold, 1e-9, origin position, 0., 0., 0.")})
    EXPECT_EQ(findings(deck_with(text), Severity::error), "") << text;
}

/// The same shape twice: modes that no equation can tell apart.
TEST(ModalCard, WarnsOfDuplicatedModes) {
  FemData data = decks::hand_made(true);
  data.shapes.col(1) = data.shapes.col(0);
  data.mass.setConstant(2);
  data.stiffness.setConstant(1);
  ModalDeck deck = deck_with(card("dynamic", "twice"));
  deck.files["twice.fem"] = write_fem_text(data, {});
  expect_warned(deck, "dependent modes: 1, 2");
}

/// A modal node stands and falls with its joint.
TEST(ModalNode, WithoutAModalJointIsRefused) {
  ModalDeck deck;
  deck.node(1, "modal");
  deck.joints = "body: 1, 1, 1., null, eye;\n";
  expect_refused(deck, "structural node 1: no modal joint uses this modal node");
  deck = deck_with(card("no damping", "no damping"));
  deck.nodes.replace(deck.nodes.find(";\n"), 1, ", prediction node, 2;");
  EXPECT_NE(findings(deck, Severity::error), "");
}

TEST(ModalForce, NamesWhatItRefuses) {
  const std::pair<const char*, const char*> bad[] = {
      {"force: 1, modal, 9, const, 1., const, 1.;", "joint 9"},
      {"force: 1, modal, 1, list, 3, 1, 2, 1, const, 1., const, 1., const, 1.;",
       "the number of modes must be 1 to 2, got 3"},
      {"force: 1, modal, 1, list, 1, 3, const, 1.;", "mode 3 is not one of the active modes"},
      {"force: 1, modal, 1, list, 2, 1, 1, const, 1., const, 1.;", "mode 1 is listed twice"},
      {"force: 1, modal, 1, list, 2000000000, 1, const, 1.;",
       "the number of modes must be 1 to 2"}};
  for (const auto& [force, message] : bad) {
    ModalDeck deck = deck_with(kCard);
    deck.forces = std::string(force) + "\n";
    expect_refused(deck, message);
  }
  ModalDeck clamped = deck_with("joint: 1, modal, clamped, 2, 3, no damping, \"dynamic.fem\", 0;");
  clamped.nodes.clear();
  clamped.forces = "force: 1, modal, 1, list, 1, 1, const, 1., resultant, 1.,0.,0., 0.,0.,0.;\n";
  expect_refused(clamped, "`resultant` needs a modal joint with a modal node");
}

/// Private data that do not exist are refused where a drive names them.
TEST(ModalPrivateData, NamesWhatItRefuses) {
  for (const char* name :
       {"q[3]", "q[#0]", "qPPP[1]", "x[1003,4]", "x[77,1]", "wPP[1003,1]", "z[1]"}) {
    ModalDeck deck = deck_with(kCard);
    deck.forces = "force: 1, absolute, 2, position, null, 0.,0.,1., element, 1, joint, string, \"" +
                  std::string(name) + "\", direct;\n";
    expect_refused(deck, "has no private datum");
  }
}

TEST(ModalCard, RefusesABodyOfVariableMassOnItsNode) {
  ModalDeck deck = deck_with(kCard);
  deck.others =
      "body: 1, 1, variable mass, const, 1., null, single, eye, const, 1., single, eye, const, "
      "1.;\n";
  expect_refused(deck,
                 "structural node 1 is a modal node; a body of variable mass cannot stand there");
}

}  // namespace
}  // namespace mbcosim::modal_refusal_test
