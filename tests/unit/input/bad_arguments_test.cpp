/// Cards of thermal, bulk and user elements, of contacts, sliders, helicoidal beams and
/// regularizations, with
/// arguments that are missing, too many, of another kind, not finite or out of range: each is
/// refused at its place, with a remedy.
#include <gtest/gtest.h>

#include <set>

#include "deck_fixture.h"
#include "word_cards.h"

namespace mbcosim::decks::bad_arguments_test {
namespace {

struct GoodCard {
  const char* name;
  const char* before;      ///< other cards
  const char* card;        ///< with all that may be left out
  std::set<int> complete;  ///< numbers of arguments with which the card is whole
};

void PrintTo(const GoodCard& c, std::ostream* out) { *out << c.name; }

const GoodCard kCards[] = {
    {"capacitance", "", "thermal: 90, capacitance, 4, 2.", {}},
    {"resistance", "", "thermal: 90, resistance, 4, 5, 2.", {}},
    {"source", "", "thermal: 90, source, 4, const, 1.", {}},
    {"bulk", "", "bulk: 90, spring support, 1, structural, 2, const, 3.", {}},
    {"wheel2",
     "",
     "user defined: 90, wheel2, 1, 0.,1.,0., 2, null, 0.,0.,1., .5, .1, .3, 1e5, 1.25, 10., slip, "
     "const, 1., const, 1., const, 1., threshold, .1, .2",
     {17, 24}},
    {"inline_friction",
     "",
     "user defined: 90, inline friction, node1, 1, offset, null, hinge, eye, node2, 3, offset, "
     "null, coulomb friction coefficient, .3, static friction coefficient, .4, sliding velocity "
     "coefficient, .5, sliding velocity exponent, 1., micro slip displacement, 1e-3, initial "
     "stiction state, .1, initial stiction derivative, .2, viscous friction coefficient, .1, "
     "stiction state equation scale, 2.",
     {10, 12, 22, 24, 26, 28}},
    {"asynchronous_machine",
     "",
     "user defined: 90, asynchronous_machine, rotor, 1, stator, 2, MK, 10., sK, .3, OmegaS, const, "
     "30., motor on, const, 1., M0, 1., MP0, 1.",
     {13, 16, 18}},
    {"hbeam",
     "",
     "hbeam: 90, 1, null, orientation, eye, 3, null, orientation, eye, linear elastic generic, "
     "diag, 1.,1.,1.,1.,1.,1.",
     {}},
    {"rod_bezier",
     "",
     "joint: 90, rod bezier, 1, null, .3,0.,0., 3, -.3,0.,0., null, 1.2, integration order, 2, "
     "integration segments, 3, linear elastic, 10.",
     {}},
    {"deformable_displacement_hinge",
     "",
     "joint: 90, deformable displacement hinge, 1, null, hinge, eye, 3, null, hinge, eye, linear "
     "viscoelastic, 10., 1.",
     {}},
    {"regularization",
     "joint: 90, spherical hinge, 1, null, 3, null; ",
     "joint regularization: 90, tikhonov, list, 1e-6, 1e-6, 1e-6",
     {2}},
    {"dynamic_regularization",
     "joint: 90, spherical hinge, 1, null, 3, null; ",
     "joint regularization: 90, dynamic, 1e-6",
     {2}},
    {"total_internal_couple",
     "",
     "couple: 90, total internal, 1, position, null, force orientation, eye, moment orientation, "
     "eye, 3, position, null, force, 1., 2., 3., const, 2., moment, 3., 1., 2., const, 1.",
     {10, 12, 18}},
    {"point_contact", "", "joint: 90, point contact, 1, 2, 0.,0.,1., 1e4", {}},
    {"beam_slider",
     "beam3: 89, 2, null, 1, 0.,0.,-.5, 3, null, eye, linear elastic generic, eye, same, same; ",
     "joint: 90, beam slider, 7, null, hinge, eye, type, classic, 1, 89, null, null, null, initial "
     "beam, 1, initial node, 2, smearing, .1",
     {13, 15, 17}},
};

DeckText deck(const GoodCard& c, const std::string& card) {
  DeckText d;
  d.nodes =
      "structural: 1, dynamic, 1.,0.,.5, eye, null, null; structural: 2, static, null, eye, null, "
      "null; structural: 3, dynamic, 2.,0.,0., eye, null, null; structural: 7, dynamic, "
      ".5,0.,0., eye, null, null; thermal: 4, value, 1.; thermal: 5; abstract: 6;";
  d.elements = std::string(c.before) + "\n" + card + ";";
  return d;
}

class BadArguments : public testing::TestWithParam<GoodCard> {
 protected:
  /// Refused, at a place of the card.
  void expect_refused(const std::string& card) {
    SCOPED_TRACE(card);
    const DeckText d = deck(GetParam(), card);
    const std::string text = d.text();
    const int line =
        1 + static_cast<int>(std::count(text.begin(), text.begin() + text.find(card), '\n'));
    const LoadReport report = load(d);
    EXPECT_FALSE(report.ok());
    for (const Diagnostic& e : report.diagnostics) {
      if (e.severity != Severity::error) continue;
      EXPECT_EQ(e.line, line) << e.text();
      EXPECT_GT(e.column, 0) << e.text();
      EXPECT_FALSE(e.message.empty());
      EXPECT_FALSE(e.hint.empty()) << e.text();
    }
  }
};

TEST_P(BadArguments, AreNotThereInTheWholeCard) {
  const LoadReport report = load(deck(GetParam(), GetParam().card));
  EXPECT_TRUE(report.ok()) << findings(report.diagnostics);
}

TEST_P(BadArguments, AreMissed) {
  const std::vector<std::string> parts = arguments(GetParam().card);
  for (std::size_t count = 2; count < parts.size(); ++count) {
    const std::string card = joined({parts.begin(), parts.begin() + count});
    if (GetParam().complete.count(static_cast<int>(count)))
      EXPECT_TRUE(load(deck(GetParam(), card)).ok()) << card;
    else
      expect_refused(card);
  }
}

TEST_P(BadArguments, AreTooMany) { expect_refused(std::string(GetParam().card) + ", 77."); }

TEST_P(BadArguments, AreOfAnotherKindOrNotFinite) {
  const std::vector<std::string> parts = arguments(GetParam().card);
  for (std::size_t k = 1; k < parts.size(); ++k)
    for (const char* bad : {"\"text\"", "0./0.", "1e400", "foreign"}) {
      std::vector<std::string> changed = parts;
      changed[k] = bad;
      expect_refused(joined(changed));
    }
}

INSTANTIATE_TEST_SUITE_P(Cards, BadArguments, testing::ValuesIn(kCards),
                         [](const auto& info) { return std::string(info.param.name); });

struct OutOfRange {
  const char* card;
  const char* message;
};

TEST(OutOfRangeArguments, AreNamedWithWhatIsAccepted) {
  const OutOfRange cases[] = {
      {"thermal: 90, capacitance, 4, -2.",
       "thermal element 90 (capacitance): the thermal capacitance must be positive, got -2.000000"},
      {"thermal: 90, capacitance, 6, 2.",
       "thermal element 90 (capacitance): thermal node 6 is not defined"},
      {"thermal: 90, resistance, 4, 5, 0.",
       "thermal element 90 (resistance): the thermal resistance must be positive, got 0.000000"},
      {"thermal: 90, resistance, 4, 4, 1.",
       "thermal element 90 (resistance): both ends of the resistance are thermal node 4"},
      {"joint: 90, point contact, 1, 2, 0.,0.,1., -1e4",
       "joint 90 (point contact): the stiffness must be positive, got -10000.000000"},
      {"joint: 90, point contact, 1, 2, null, 1e4",
       "joint 90 (point contact): normal of the plane: direction is null"},
      {"user defined: 90, wheel2, 1, 0.,1.,0., 2, null, 0.,0.,1., -.5, .1, .3, 1e5, 1.25, 10.",
       "user defined element 90 (wheel2): the radius of the wheel must be positive, got -0.500000"},
      {"user defined: 90, wheel2, 1, 0.,1.,0., 2, null, 0.,0.,1., .1, .5, .3, 1e5, 1.25, 10.",
       "user defined element 90 (wheel2): the radius of the tyre, 0.500000, must be less than that "
       "of the wheel, 0.100000"},
      {"user defined: 90, wheel2, help",
       "user defined element 90 (wheel2): nothing follows `help`"},
      {"user defined: 90, inline friction, node1, 1, node2, 3, coulomb friction coefficient, -.3, "
       "micro slip displacement, 1e-3",
       "user defined element 90 (inline friction): the coulomb friction coefficient must not be "
       "negative, got -0.300000"},
      {"user defined: 90, inline friction, node1, 1, node2, 3, coulomb friction coefficient, .3, "
       "micro slip displacement, 1e-3, initial stiction state, 2.",
       "user defined element 90 (inline friction): the initial stiction state must be between -1 "
       "and 1, got 2.000000"},
      {"user defined: 90, asynchronous_machine, rotor, 1, stator, 2, MK, 10., sK, -.3, OmegaS, 30.",
       "user defined element 90 (asynchronous_machine): the breakdown slip must be positive, got "
       "-0.300000"},
      {"user defined: 90, imu, 1",
       "user defined element 90: \"imu\" is not served: it comes from a run-time module of the "
       "reference solver"},
      {"joint: 91, spherical hinge, 1, null, 3, null; joint regularization: 91, dynamic, -1.",
       "joint regularization 91 (dynamic): regularization coefficient must not be negative, got "
       "-1.000000"},
      {"joint: 91, clamp, 2, node, node; joint regularization: 92, dynamic, 1.",
       "joint regularization 92 (dynamic): joint 92 is not defined"},
      {"joint: 90, rod bezier, 1, null, .3,0.,0., 3, -.3,0.,0., null, -1.2, linear elastic, 10.",
       "joint 90 (rod bezier): the length must be positive"},
      {"joint: 90, rod bezier, 1, null, .3,0.,0., 3, -.3,0.,0., null, 1.2, integration order, 11, "
       "linear elastic, 10.",
       "joint 90 (rod bezier): the integration order must be from 1 to 10, got 11"},
      {"hbeam: 90, 1, null, 3, null, linear viscoelastic generic, eye, eye",
       "beam 90: hbeam: only elastic laws are accepted"},
      {"joint: 90, beam slider, 7, null, 1, 77, null, null, null",
       "joint 90 (beam slider): beam 77 is not defined"},
      {"bulk: 90, spring support, 1, structural, 9, 1.",
       "bulk element 90 (spring support): structural node 1 has 6 degrees of freedom; index 9"},
  };
  for (const OutOfRange& c : cases) {
    SCOPED_TRACE(c.card);
    std::string found;
    for (const Diagnostic& d : load(deck(kCards[0], c.card)).diagnostics) {
      if (d.severity != Severity::error || !found.empty()) continue;
      found = d.message;
      EXPECT_FALSE(d.hint.empty()) << d.text();
    }
    EXPECT_EQ(found.substr(0, std::string(c.message).size()), c.message);
  }
}

}  // namespace
}  // namespace mbcosim::decks::bad_arguments_test
