/// Every word of the registry with arguments that are missing, too many, of another kind, not
/// finite or negative: each is refused at its place with a remedy, but those of which a table says
/// that they may be so.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <map>
#include <set>

#include "deck_fixture.h"
#include "word_cards.h"

namespace mbcosim::decks::words_refused_test {
namespace {

/// Begin what may be left out of a card.
const std::set<std::string> kOptional = {"M0",
                                         "MP0",
                                         "all",
                                         "amplitude",
                                         "coulomb friction coefficient",
                                         "end",
                                         "force",
                                         "force orientation",
                                         "friction",
                                         "hinge",
                                         "initial node",
                                         "initial value",
                                         "initial values",
                                         "linear stiffness",
                                         "mapped points number",
                                         "moment",
                                         "moment orientation",
                                         "offset",
                                         "orientation constraint",
                                         "output",
                                         "port",
                                         "position",
                                         "position constraint",
                                         "position orientation",
                                         "pressure",
                                         "prestrain",
                                         "prestress",
                                         "rotation orientation",
                                         "second damping",
                                         "seed",
                                         "slip",
                                         "steps",
                                         "temperature",
                                         "threshold",
                                         "viscous friction coefficient"};

using Numbers = std::map<std::string, std::string>;

/// Numbers that may be left out, with what follows them.
const Numbers kOptionalNumbers = {
    {"joint regularization: dynamic 1", "1e-3"},
    {"joint regularization: jacobian 1", "0."},
    {"genel: swash plate 1", ".1"},
    {"joint regularization: tikhonov 1", "1e-3"},
    {"force: external structural mapping 1", "5"},
    {"drive: file 1", "2"},
    {"law 1: turbulent viscoelastic 2", ".6 .2"},
    {"function: chebychev 1", ".5 .25"},
    {"function: multilinear 1", "1."},
};

/// Numbers that are refused with the other sign: labels, counts, what is positive by its meaning,
/// and what has to lie above or below another number. Of all others both signs mean something.
const Numbers kSigned = {
    {"body 1", "1 1.5"},
    {"beam2 1", "1 2"},
    {"beam3 1", "1 2 3"},
    {"beam 1", "1 2 3"},
    {"hbeam 1", "1 2"},
    {"joint: beam slider 1", "8 1 89 2"},
    {"joint: rod bezier 1", "1 2 1.2 3 2"},
    {"joint: point contact 1", "1 2 40."},
    {"joint: deformable displacement hinge 1", "1 2"},
    {"joint regularization: dynamic 1", "1e-3"},
    {"couple: total internal 1", "1 2"},
    {"thermal: capacitance 1", "41 2.5"},
    {"thermal: resistance 1", "41 42 .7"},
    {"thermal: source 1", "41 1."},
    {"bulk: spring support 1", "1 2"},
    {"user defined: wheel2 1", "1 2 2. .8 1.2 50. 1.25 10. .3"},
    {"user defined: inline friction 1", "1 2 .3 .4 .2"},
    {"user defined: asynchronous_machine 1", "1 2 .4"},
    {"joint: clamp 1", "1"},
    {"joint: spherical hinge 1", "1 2"},
    {"joint: distance 1", "1 2"},
    {"joint: distance with offset 1", "1 2"},
    {"joint: total equation 1", "1 2"},
    {"joint: total internal reaction 1", "2 3 89"},
    {"genel: clamp 1", "11 1."},
    {"genel: cross spring support 1", "11 12"},
    {"genel: distance 1", "11 12 1."},
    {"genel: mass 1", "11"},
    {"genel: scalar filter 1", "11 12 2 1"},
    {"genel: spring 1", "11 12"},
    {"genel: spring support 1", "11"},
    {"genel: state space MIMO 1", "2 11 12 1 1 2 2"},
    {"genel: state space SISO 1", "11 12 2"},
    {"genel: swash plate 1", "11 12 13 14 15 16 .1"},
    {"electric: accelerometer 1", "1 11 20. .1"},
    {"electric: displacement 1", "1 2 11"},
    {"electric: motor 1", "1 2 21 22"},
    {"electric: discrete control 1", "1 1 1 1 11 12"},
    {"force: absolute 1", "1 1."},
    {"force: follower 1", "1 1."},
    {"force: absolute displacement 1", "5 1."},
    {"force: absolute internal 1", "1 2"},
    {"force: follower internal 1", "1 2"},
    {"force: absolute internal displacement 1", "5 6"},
    {"force: total 1", "1"},
    {"force: total internal 1", "1 2"},
    {"force: abstract 1", "11 1."},
    {"force: abstract internal 1", "11 12 1."},
    {"couple: absolute 1", "1"},
    {"couple: follower 1", "1"},
    {"couple: absolute internal 1", "1 2"},
    {"couple: follower internal 1", "1 2"},
    {"force: conservative 1", "1 1."},
    {"force: conservative internal 1", "1 2"},
    {"couple: conservative 1", "1"},
    {"couple: conservative internal 1", "1 2"},
    {"joint: revolute pin 1", "1"},
    {"joint: plane pin 1", "1"},
    {"joint: revolute hinge 1", "1 2"},
    {"joint: plane hinge 1", "1 2"},
    {"joint: revolute rotation 1", "1 2"},
    {"joint: axial rotation 1", "1 2 1."},
    {"joint: pin 1", "1"},
    {"joint: spherical pin 1", "1"},
    {"joint: rod 1", "1 2 1.2"},
    {"joint: rod with offset 1", "1 2 1.2"},
    {"joint: total joint 1", "1 2 1. 1. 1. 1."},
    {"joint: total pin joint 1", "1 1. 1. 1. 1."},
    {"joint: imposed displacement 1", "1 2 1."},
    {"joint: imposed displacement pin 1", "1 1."},
    {"joint: imposed orientation 1", "1 2 1."},
    {"joint: brake 1", "1 2 .1"},
    {"joint: screw 1", "1 2"},
    {"joint: in line 1", "1 2"},
    {"joint: in plane 1", "1 2"},
    {"joint: prismatic 1", "1 2"},
    {"joint: drive hinge 1", "1 2 1."},
    {"joint: drive displacement 1", "1 2 1."},
    {"joint: drive displacement pin 1", "1 1."},
    {"joint: deformable hinge 1", "1 2"},
    {"joint: deformable displacement joint 1", "1 2"},
    {"joint: deformable joint 1", "1 2"},
    {"joint: deformable axial joint 1", "1 2"},
    {"joint: invariant deformable hinge 1", "1 2"},
    {"joint: invariant deformable displacement joint 1", "1 2"},
    {"joint: invariant deformable joint 1", "1 2"},
    {"joint: viscous body 1", "1"},
    {"joint: linear velocity 1", "1 1."},
    {"joint: angular velocity 1", "1 1."},
    {"joint: linear acceleration 1", "1 1."},
    {"joint: angular acceleration 1", "1 1."},
    {"joint: cardano hinge 1", "1 2"},
    {"joint: universal hinge 1", "1 2"},
    {"joint: cardano rotation 1", "1 2"},
    {"joint: universal rotation 1", "1 2"},
    {"joint: cardano pin 1", "1"},
    {"joint: universal pin 1", "1"},
    {"joint: gimbal rotation 1", "1 2"},
    {"joint regularization: tikhonov 1", "1e-3"},
    {"hydraulic: actuator 1", "31 32 1 2 .02 .01 1.5 870. 1.5e9 .07"},
    {"hydraulic: orifice 1", "31 32 .01 1.e-5 870. 1.5e9 .07"},
    {"hydraulic: dynamic pipe 1", "31 32 .01 2. 870. 1.5e9 .07"},
    {"hydraulic: pipe 1", "31 32 .012 2. 870. 1.5e9 .07"},
    {"hydraulic: minor loss 1", "31 32 1.5 2.5 1.e-4 870. 1.5e9 .07"},
    {"hydraulic: three way minor loss 1", "31 32 33 1.5 2.5 1.e-4 2.e-4 870. 1.5e9 .07"},
    {"hydraulic: control valve 1", "31 32 33 34 1.e-4 1. 870. 1.5e9 .07"},
    {"hydraulic: control valve2 1", "31 32 33 34 1.e-4 1. 870. 1.5e9 .07"},
    {"hydraulic: dynamic control valve 1", "31 32 33 34 .01 .01 1.e-6 .1 870. 1.5e9 .07"},
    {"hydraulic: pressure flow control 1",
     "31 32 33 34 35 36 .001 .01 .01 1.e-6 .1 870. 1.5e9 .07"},
    {"hydraulic: pressure flow control valve 1",
     "31 32 33 34 35 36 .001 .01 .01 1.e-6 .1 870. 1.5e9 .07"},
    {"hydraulic: pressure valve 1", "31 32 1.e-4 .05 1.e-4 .01 5.e4 20. .01 870. 1.5e9 .07"},
    {"hydraulic: flow valve 1", "31 32 33 1.e-5 .05 1.e-4 2.e-4 5.e4 20. .01 .002 870. 1.5e9 .07"},
    {"hydraulic: accumulator 1", "31 .5 .01 1.e-4 2. 1.e5 1.e6 1.3 870. 1.5e9 .07"},
    {"hydraulic: tank 1", "31 32 1.e5 1.e-4 .1 1. .5 870. 1.5e9 .07"},
    {"output element: stream 1", "1"},
    {"stream output 1", "1"},
    {"stream motion output 1", "1"},
    {"force: external structural 1", "3 2 1 7 2"},
    {"force: external structural mapping 1", "3 2 1 2 1 5"},
    {"joint: modal 1", "7 3 4 1 3 2"},
    {"force: modal 1", "89"},
    {"force: external modal 1", "89"},
    {"force: external modal mapping 1", "3 2 1 2 1 1e-9"},
    {"output element: socket stream 1", "1"},
    {"RTAI output 1", "1"},
    {"drive: array 1", "2"},
    {"drive: discrete filter 1", "2 1"},
    {"drive: dof 1", "1 2"},
    {"drive: double ramp 1", "3e-3 4e-3"},
    {"drive: double step 1", "4e-3"},
    {"drive: element 1", "80"},
    {"drive: file 1", "82 2"},
    {"drive: fourier series 1", "2"},
    {"drive: max 1", "2"},
    {"drive: meter 1", "3"},
    {"drive: min 1", "2"},
    {"drive: node 1", "1"},
    {"drive: periodic 1", "3e-3"},
    {"drive: piecewise linear 1", "3 2e-3 1."},
    {"drive: postponed 1", "81"},
    {"drive: ramp 1", "4e-3"},
    {"drive: random 1", "2"},
    {"drive: step5 1", "4e-3"},
    {"law 1: linear elastic 1", "11 1."},
    {"law 1: linear elastic isotropic 1", "11 1."},
    {"law 1: linear elastic generic 1", "11 1."},
    {"law 1: isotropic hardening elastic 1", "11 .3 1."},
    {"law 1: isotropic hardening elastic 2", "11 .3 1."},
    {"law 1: linear viscous 1", "11"},
    {"law 1: linear viscous isotropic 1", "11"},
    {"law 1: linear viscous generic 1", "11"},
    {"law 1: linear viscoelastic 1", "11 1."},
    {"law 1: linear viscoelastic isotropic 1", "11 1."},
    {"law 1: linear viscoelastic generic 1", "11 1."},
    {"law 1: linear viscoelastic generic 2", "11 1."},
    {"law 1: linear time variant viscoelastic generic 1", "11 1."},
    {"law 1: linear time variant viscoelastic generic 2", "11 1."},
    {"law 1: linear elastic bistop 1", "11 1."},
    {"law 1: linear viscoelastic bistop 1", "11 1."},
    {"law 1: nlsf elastic 1", "11 1."},
    {"law 1: nlsf viscous 1", "11"},
    {"law 1: nlsf viscoelastic 1", "11 1."},
    {"law 1: nlp elastic 1", "11 1."},
    {"law 1: nlp viscous 1", "11"},
    {"law 1: nlp viscoelastic 1", "11 1."},
    {"law 1: scalar function elastic isotropic 1", "11"},
    {"law 1: scalar function elastic orthotropic 1", "11"},
    {"law 1: array 1", "11 2"},
    {"law 1: array 2", "11 1"},
    {"law 1: drive caller wrapper 1", "11"},
    {"law 1: bistop 1", "11"},
    {"law 1: cubic elastic generic 1", "11 1."},
    {"law 1: cubic viscoelastic generic 1", "11 1."},
    {"law 1: double linear elastic 1", "11 .1 -.1 1."},
    {"law 1: double linear viscoelastic 1", "11 .1 -.1 1."},
    {"law 1: contact elastic 1", "11 2."},
    {"law 1: scalar function elastic 1", "11"},
    {"law 1: inverse square elastic 1", "11 2. 1."},
    {"law 1: log elastic 1", "11 1."},
    {"law 1: turbulent viscoelastic 1", "11 1."},
    {"law 1: turbulent viscoelastic 2", "11 .6 1."},
    {"law 1: contact elastic 2", "11 2. 1."},
    {"law 1: shock absorber 1", "11 .3"},
    {"law 1: symbolic elastic 1", "11 1."},
    {"law 1: symbolic viscous 1", "11"},
    {"law 1: symbolic viscoelastic 1", "11 1."},
    {"law 1: symbolic 1", "11 1."},
    {"function: chebychev 1", "-1. 1."},
    {"function: cubic spline 1", "-1. 1."},
    {"function: exp 1", "2."},
    {"function: log 1", "2."},
    {"function: multilinear 1", "-1. 1."},
    {"fluid: exponential 1", "870. 1300. .07"},
    {"fluid: incompressible 1", "870. .07"},
    {"fluid: linear compressible 1", "870. 1300. .07"},
    {"fluid: linear thermal compressible 1", "870. 1.5e9 .07"},
    {"fluid: super 1", "870. 1300. .07"},
    {"fluid: uncompressible 1", "870. .07"},
    {"file driver: RTAI input 1", "2"},
    {"file driver: fixed step 1", "3 2 .1"},
    {"file driver: socket stream 1", "2"},
    {"file driver: socket 1", "2 5555"},
    {"file driver: stream 1", "2"},
    {"file driver: variable step 1", "2"},
};

class RefusedWord : public testing::TestWithParam<WordCard> {
 protected:
  static void add(std::string& list, const std::string& item) {
    list += (list.empty() ? "" : " ") + item;
  }
  /// The entry of the word; "drive: ramp 1" is the first card of "drive: ramp".
  static std::string of_word(const Numbers& numbers) {
    const auto found = numbers.find(GetParam().word);
    return found == numbers.end() ? "" : found->second;
  }
  /// Refused; the first error is at a place of the card, in words, with a remedy.
  static bool refused(const std::string& changed) {
    WordCard word = GetParam();
    word.card = changed;
    auto files = word_deck(word, Bench::bare);
    const std::string& text = files["deck.mbd"];
    const auto line =
        1 + std::count(text.begin(), text.begin() + text.find("\n" + changed) + 1, '\n');
    const LoadReport report = load_deck(BundleSource(std::move(files)), "deck.mbd");
    for (const Diagnostic& d : report.diagnostics) {
      if (d.severity != Severity::error) continue;
      EXPECT_EQ(d.line, line) << changed << "\n" << d.text();
      EXPECT_GT(d.column, 0) << changed << "\n" << d.text();
      EXPECT_FALSE(d.message.empty()) << changed;
      EXPECT_FALSE(d.hint.empty()) << changed << "\n" << d.text();
      break;
    }
    EXPECT_EQ(report.ok(), findings(report.diagnostics).find("error") == std::string::npos);
    return !report.ok();
  }
  const std::vector<std::string> parts_ = arguments(GetParam().card);
};

TEST_P(RefusedWord, IsReadWithItsArguments) { EXPECT_FALSE(refused(GetParam().card)); }

TEST_P(RefusedWord, NeedsItsArguments) {
  std::string ends;
  for (std::size_t count = 1; count < parts_.size(); ++count)
    if (!refused(joined({parts_.begin(), parts_.begin() + count})) &&
        kOptional.count(parts_[count]) == 0)
      add(ends, parts_[count]);
  EXPECT_EQ(ends, of_word(kOptionalNumbers)) << "accepted without what begins so";
}

TEST_P(RefusedWord, TakesNoMore) { EXPECT_TRUE(refused(GetParam().card + ", 77.")); }

TEST_P(RefusedWord, TakesNoOtherKindOfArgument) {
  for (std::size_t k = 1; k < parts_.size(); ++k)
    for (const std::string bad : {"\"text\"", "0./0.", "1e400", "foreign"}) {
      if (bad == "\"text\"" && parts_[k][0] == '"') continue;
      std::vector<std::string> changed = parts_;
      changed[k] = bad;
      EXPECT_TRUE(refused(joined(changed))) << joined(changed);
    }
}

TEST_P(RefusedWord, TakesNegativeNumbersWhereTheyMeanSomething) {
  if (GetParam().word.rfind("law 3", 0) == 0 || GetParam().word.rfind("law 6", 0) == 0)
    return;  // read by the same functions as in one dimension
  std::string refused_numbers;
  for (std::size_t k = 1; k < parts_.size(); ++k) {
    char* end = nullptr;
    const double number = std::strtod(parts_[k].c_str(), &end);
    if (*end != 0 || number == 0) continue;
    std::vector<std::string> changed = parts_;
    changed[k] = number < 0 ? changed[k].substr(1) : "-" + changed[k];
    if (refused(joined(changed))) add(refused_numbers, parts_[k]);
  }
  EXPECT_EQ(refused_numbers, of_word(kSigned)) << "refused with the other sign";
}

INSTANTIATE_TEST_SUITE_P(Named, RefusedWord, testing::ValuesIn(numbered_word_cards()),
                         [](const auto& info) { return test_name(info.param); });

}  // namespace
}  // namespace mbcosim::decks::words_refused_test
