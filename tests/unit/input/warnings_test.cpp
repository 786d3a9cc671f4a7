/// Decks that are read, with a word of warning; and words of the language that are refused by name.
#include <gtest/gtest.h>

#include "deck_fixture.h"
#include "elements/families.h"

namespace mbcosim::decks::warnings_test {
namespace {

const char* const kNode = "structural: 1, dynamic, null, eye, null, null;";

std::string of_initial_value(const std::string& cards) {
  DeckText d;
  d.initial_value = cards;
  return findings(load(d).diagnostics);
}
std::string of_control(const std::string& cards) {
  DeckText d;
  d.control = cards;
  return findings(load(d).diagnostics);
}
std::string of_elements(const std::string& cards) {
  DeckText d;
  d.nodes = kNode;
  d.elements = cards;
  return findings(load(d).diagnostics);
}

TEST(PostponedDrive, IsNamedWhereItsDriveNeverComes) {
  EXPECT_EQ(
      of_elements("drive caller: 1, array, 2, postponed, 2, postponed, 3; drive caller: 2, "
                  "const, 1.;"),
      "warning: postponed to drive caller 3, which the deck does not define: it has no value");
  DeckText d;
  d.nodes = kNode;
  d.elements = "drive caller: 1,\npostponed, 3;";
  EXPECT_EQ(load(d).diagnostics.at(0).source_line, "postponed, 3;");
}

// ------------------------------------------------------------------------------------ frozen
// values

TEST(FrozenValue, IsNamedInEveryFormThatChangesDuringTheRun) {
  const std::string frozen =
      "warning: drive caller 1: drive: value frozen at input time; use a string drive";
  for (const char* drive : {"2.*Time", "TimeStep + 1.", "Step*2", "Var + 1.", "Time*2.", "(Step)",
                            "model::position(1)", "X1*2."})
    EXPECT_EQ(of_elements("set: [node, X1, 1, structural, string=\"X[1]\"]; drive caller: 1, " +
                          std::string(drive) + ";"),
              frozen)
        << drive;
}

TEST(FrozenValue, IsMeantWhereItIsWrittenAsOne) {
  for (const char* drive :
       {"const, Time", "time", "Time", "string, \"Time*2\"", "2.*pi", "(tanh(3.))"})
    EXPECT_EQ(of_elements("drive caller: 1, " + std::string(drive) + ";"), "") << drive;
}

TEST(Warnings, SayThatThereAreMore) {
  const LoadReport report = load("for: integer k = 1, 1500;\nset: integer a = k + .5;\nend for;");
  ASSERT_TRUE(report.ok());
  EXPECT_EQ(report.diagnostics.size(), 1001u);
  EXPECT_EQ(report.diagnostics.back().message,
            "more than 1000 warnings: from here on they are not told");
}

TEST(IntegerOverflow, IsNamedWhereItWraps) {
  const auto of = [](const std::string& expression) {
    return findings(load("remark: " + expression + ";").diagnostics);
  };
  const auto wraps = [](const std::string& result) {
    return "warning: integer overflow: the result wraps to " + result;
  };
  EXPECT_EQ(of("2147483647 + 1"), wraps("-2147483648"));
  EXPECT_EQ(of("-2147483647 - 2"), wraps("2147483647"));
  EXPECT_EQ(of("65536*65536"), wraps("0"));
  EXPECT_EQ(of("2^31"), wraps("-2147483648"));
  EXPECT_EQ(of("10^10"), wraps("1410065408"));
  for (const char* fine :
       {"2^30", "(-3)^3", "2147483647 - 1", "46340*46340", "0^5", "1^2147483647"})
    EXPECT_EQ(of(fine), "") << fine;
}

TEST(NullDirection, IsNamed) {
  EXPECT_EQ(
      of_elements("gravity: uniform, 0., 0., 0., const, 9.81;"),
      "warning: gravity: acceleration of gravity: the direction is null, whatever the drive gives");
  EXPECT_EQ(of_elements("gravity: uniform, null;"), "");
}

// ------------------------------------------------------------------------------------ hidden
// variables

TEST(HiddenVariable, IsNamedWhereAKeywordTakesItsPlace) {
  DeckText d;
  d.nodes = "set: real null = 3.; structural: 1, static, null, eye, null, null;";
  const LoadReport report = load(d);
  EXPECT_EQ(findings(report.diagnostics).substr(0, 100),
            "warning: structural node 1: \"null\" is a keyword here; the variable of this name is "
            "hidden\nwarning: s");
  EXPECT_EQ(report.diagnostics.at(0).hint, "write (null) for the variable");
  EXPECT_EQ(of_elements("set: real unit = 3.; drive caller: 1, linear, unit, 1.;"), "");
  EXPECT_EQ(of_elements("set: real tanh = 3.;"), "error: \"tanh\" is a function name");
  EXPECT_EQ(of_elements("set: real ramp_ = 3.; drive caller: 1, ramp_;"), "");
  EXPECT_EQ(
      of_elements("set: real one = 3.; drive caller: 1, one;"),
      "warning: drive caller 1: \"one\" is a keyword here; the variable of this name is hidden");
  EXPECT_EQ(of_elements("set: real one = 3.; drive caller: 1, (one); drive caller: 2, one*1.;"),
            "");
  EXPECT_EQ(of_elements("set: real one = 3.; drive caller: 1, ONE;"), "");
}

// ------------------------------------------------------------------------------------ old words

TEST(OldWord, IsReadWithTheWordOfToday) {
  const auto old = [](const std::string& now) { return "deprecated: write \"" + now + "\""; };
  const auto warning = [&](const std::string& now) { return "warning: " + old(now); };
  EXPECT_EQ(of_initial_value("fictitious steps number: 2;"), warning("dummy steps number"));
  EXPECT_EQ(of_initial_value("Fictitious Steps Ratio: 1e-3;"), warning("dummy Steps Ratio"));
  EXPECT_EQ(of_initial_value("abort after: fictitious steps;"), warning("dummy steps"));
  EXPECT_EQ(of_initial_value("solver: umfpack;"), warning("linear solver"));
  EXPECT_EQ(of_control("solver: umfpack;"), warning("linear solver"));
  EXPECT_EQ(of_initial_value("newton raphson: modified, 4;"),
            warning("nonlinear solver: newton raphson"));
  EXPECT_EQ(of_initial_value("method: nostro, .6;"), warning("ms"));
  EXPECT_EQ(of_initial_value("nonlinear solver: newton raphson, modified, 5, keep jacobian;"),
            warning("keep jacobian matrix"));
  EXPECT_EQ(
      of_initial_value("nonlinear solver: matrix free, gmres, preconditioner, full jacobian;"),
      warning("full jacobian matrix"));
  EXPECT_EQ(of_control("rotors: 0;"), warning("induced velocity elements"));
  DeckText d;
  d.nodes = "structural: 1, dynamic, null, eye, null, null, output, accelerations;";
  EXPECT_EQ(findings(load(d).diagnostics),
            "warning: structural node 1: " + old("accelerations, yes"));
}

TEST(OldWord, OfTheFirstBlocks) {
  EXPECT_EQ(findings(load("begin: data; integrator: multistep; end: data;\n"
                          "begin: multistep; end: multistep;\n"
                          "begin: control data; end: control data;")
                         .diagnostics),
            "warning: deprecated: write \"problem\"\nwarning: deprecated: write \"initial value\"\n"
            "warning: deprecated: write \"initial value\"");
}

// ------------------------------------------------------------------------------------ not
// supported yet

TEST(NotSupported, EveryRegisteredWordIsRefusedByName) {
  const Registry& registry = full_registry();
  int words = 0;
  for (const auto& [shown, what, word] : registry.not_supported.at("elements")) {
    const std::string text =
        of_elements(word + (word == "airproperties" ? ": 1.;" : ": 1, 1, 2.;"));
    EXPECT_NE(text.find("\"" + std::string(shown) + "\" (" + std::string(what) +
                        ") is not supported yet"),
              std::string::npos)
        << text;
    EXPECT_EQ(text.find('\n'), std::string::npos) << text;
    ++words;
  }
  for (const auto& [head, facts] : registry.heads) {
    const auto types = registry.not_supported.find(head);
    if (types == registry.not_supported.end()) continue;
    for (const auto& [shown, what, word] : types->second) {
      const std::string text = of_elements(head + ": 1, " + word + ", 1;");
      EXPECT_NE(text.find("\"" + std::string(shown) + "\" (" + std::string(what) +
                          ") is not supported yet"),
                std::string::npos)
          << text;
      ++words;
    }
  }
  EXPECT_GT(words, 15);
}

TEST(NotSupported, DrivesLawsAndDriversAreRefusedByName) {
  EXPECT_EQ(of_elements("drive caller: 1, octave, 1.;"),
            "error: drive caller 1: \"octave\" is not served: decks run no foreign code");
  EXPECT_EQ(of_elements("constitutive law: 1, 6, neo hookean elastic, 1.;"),
            "error: constitutive law 1: \"neo hookean elastic\" (law of solid elements) is not "
            "supported yet");
  DeckText d;
  d.before = "begin: data; problem: parallel initial value; end: data;";
  EXPECT_EQ(findings(load(d).diagnostics).substr(0, 67),
            "error: \"parallel initial value\" (problem) is not supported yet\nerro");
}

TEST(NotSupported, IsSaidOncePerKindOfCard) {
  std::string cards;
  for (int k = 1; k <= 40; ++k) cards += "rotor: " + std::to_string(k) + ", 1, 2;\n";
  DeckText d;
  d.nodes = kNode;
  d.elements = cards + "body: 1, 7, 1., null, eye;";
  const LoadReport report = load(d);
  EXPECT_EQ(findings(report.diagnostics),
            "error: induced velocity element 1: \"rotor\" (induced velocity element) is not "
            "supported yet\n"
            "error: body 1: structural node 7 is not defined");
  EXPECT_EQ(report.diagnostics.at(0).code, "not-supported");
  EXPECT_EQ(report.diagnostics.at(0).hint, "39 more of this kind in the deck");
}

TEST(NotSupported, WhatFollowsFromARefusalIsNotReported) {
  DeckText d;
  d.nodes = std::string(kNode) + "parameter: 3, element;";
  d.elements =
      "rotor: 5, 1, 2; bind: 5, rotor, 3, string, \"x\";\n"
      "drive caller: 1, element, 5, rotor, string, \"x\", direct;\n"
      "output: rotor, 5;";
  EXPECT_EQ(findings(load(d).diagnostics),
            "error: induced velocity element 5: \"rotor\" (induced velocity element) is not "
            "supported yet");
}

TEST(NotServed, DeadWordsSayWhyAndWhatToWrite) {
  const auto refusal = [](const std::string& card) {
    DeckText d;
    d.nodes = kNode;
    d.elements = card;
    const LoadReport report = load(d);
    if (report.diagnostics.empty()) return std::string();
    return report.diagnostics[0].message + "; " + report.diagnostics[0].hint;
  };
  EXPECT_EQ(refusal("joint: 1, plane displacement, 1;"),
            "joint 1: \"plane displacement\" is not served: the reference solver reads it and "
            "stops; use `in plane` and `revolute rotation`");
  EXPECT_EQ(refusal("couple: 1, abstract, 1;"),
            "force 1: \"abstract\" is not served: it is a force, not a couple; write `force: "
            "<label>, abstract`");
  EXPECT_EQ(refusal("hydraulic: 1, full pipe, 1;"),
            "hydraulic element 1: \"full pipe\" is not served: the reference solver has no such "
            "element; use `pipe` or `dynamic pipe`");
  EXPECT_EQ(refusal("drive caller: 1, sh, 1.;"),
            "drive caller 1: \"sh\" is not served: the reference solver has no such drive; use "
            "`sample and hold`");
}

TEST(ModuleLoad, KnowsTheModulesWhoseElementsAreBuiltIn) {
  const auto finding = [](const std::string& card) { return of_elements(card); };
  EXPECT_EQ(finding("module load: \"libs/libmodule-wheel2.la\", 1;"),
            "");  // a note
  EXPECT_EQ(finding("module load: \"libmodule-octave\";"),
            "error: module \"octave\" is not served: decks load no code");
  EXPECT_EQ(finding("user defined: 1, octave, 1;"),
            "error: user defined element 1: \"octave\" is not served: it comes from a run-time "
            "module of the "
            "reference solver");
}

TEST(C81Data, IsReadWithoutEffect) {
  const auto read = [](const std::string& card) {
    DeckText d;
    d.before = card;
    return findings(load(d.text(), {{"naca.c81", "0012"}}).diagnostics);
  };
  const std::string note =
      "warning: c81 data 1: without effect: aerodynamic elements are not supported yet";
  EXPECT_EQ(read("c81 data: 1, \"naca.c81\";\n"), note);
  EXPECT_EQ(
      read("c81 data: 1, name, \"tip\", \"naca.c81\", tolerance, 1e-4, fc511, flip, echo, \"o\", "
           "free format;\n"),
      note);
  EXPECT_EQ(read("c81 data: 1, \"none.c81\";\n"),
            "error: cannot open \"none.c81\" (searched in the deck's folder)");
  EXPECT_EQ(read("c81 data: 1, \"naca.c81\"; c81 data: 1, \"naca.c81\";\n"),
            note + "\nerror: c81 data 1 already defined at deck.mbd:1");
}

}  // namespace
}  // namespace mbcosim::decks::warnings_test
