#include "model/unit_system.h"

#include <gtest/gtest.h>

namespace mbcosim::unit_system_test {
namespace {

const UnitSystem kSi{"m", "kg", "", "s"}, kTonne{"mm", "t", "", "s"}, kByForce{"mm", "", "N", "s"},
    kMilli{"mm", "kg", "", "ms"}, kInches{"in", "", "lbf", "s"}, kPounds{"ft", "lb", "", "s"};
constexpr Dimension kForce{1, 1, -2}, kInertia{1, 2}, kMass{1};

TEST(UnitSystem, NamesOfSiAreThoseOfTheEngine) {
  for (const char* unit : {"", "1", "m", "rad/s", "kg m^2/s", "N, N m", "1/(m s)", "Pa/s", "V", "K",
                           "kg/m^3", "J", "W", "A", "deg"})
    EXPECT_EQ(kSi.name(unit), unit);
}

TEST(UnitSystem, DerivedUnitsHaveTheirUsualNames) {
  EXPECT_EQ(kTonne.name("N, N m"), "N, N mm");
  EXPECT_EQ(kTonne.name("Pa"), "MPa");
  EXPECT_EQ(kTonne.name("J"), "mJ");
  EXPECT_EQ(kTonne.name("kg m^2/s"), "t mm^2/s");
  EXPECT_EQ(kByForce.name("kg"), "t");
  EXPECT_EQ(kMilli.name("N"), "kN");
  EXPECT_EQ(kMilli.name("Pa"), "GPa");
  EXPECT_EQ(kMilli.name("rad/s^2"), "rad/ms^2");
  EXPECT_EQ(kMilli.name("Hz"), "kHz");
  EXPECT_EQ(kInches.name("Pa"), "psi");
}

TEST(UnitSystem, WhatHasNoNameIsWrittenInBaseUnits) {
  EXPECT_EQ(kPounds.name("N"), "lb ft/s^2");
  EXPECT_EQ(kPounds.name("N m"), "lb ft^2/s^2");
  EXPECT_EQ(kInches.name("kg"), "lbf s^2/in");
  EXPECT_EQ(kPounds.name("Pa"), "lb/(ft s^2)");
}

TEST(UnitSystem, DimensionsHaveNamesToo) {
  EXPECT_EQ(kTonne.name(kForce), "N");
  EXPECT_EQ(kTonne.name(Dimension{0, 1, -1}), "mm/s");
  EXPECT_EQ(kTonne.name(Dimension{}), "1");
}

TEST(UnitSystem, OneUnitInSiIsAProductOfThePowers) {
  EXPECT_DOUBLE_EQ(kTonne.si(kForce), 1);
  EXPECT_DOUBLE_EQ(kByForce.si(kMass), 1000);
  EXPECT_DOUBLE_EQ(kTonne.si(kInertia), 1e-3);
  EXPECT_DOUBLE_EQ(kMilli.si(kForce), 1000);
  EXPECT_DOUBLE_EQ(kInches.si(kForce), 4.4482216152605);
  EXPECT_NEAR(kInches.si(kMass), 175.12683524647636, 1e-12);  // lbf s²/in in kg
}

TEST(UnitSystem, TheSameSystemByForceAndByMassIsOne) {
  EXPECT_TRUE(kTonne == kByForce);
  EXPECT_FALSE(kTonne == kSi);
  EXPECT_FALSE(kTonne == (UnitSystem{"mm", "t", "", "ms"}));
}

TEST(UnitSystem, WithoutADeclarationUnitsAreTheDecks) {
  EXPECT_EQ(deck_unit("m"), "deck unit of length");
  EXPECT_EQ(deck_unit("N, N m"), "deck unit of force, deck unit of force length");
  EXPECT_EQ(deck_unit("kg m^2/s"), "deck unit of mass length^2/time");
  EXPECT_EQ(deck_unit("rad/s"), "deck unit of rad/time");
  EXPECT_EQ(deck_unit("rad"), "rad");
  EXPECT_EQ(deck_unit(""), "");
  EXPECT_EQ(unit_name(nullptr, "m"), "deck unit of length");
  EXPECT_EQ(unit_name(&kTonne, "m"), "mm");
}

TEST(UnitSystem, TextsAreReadWithPrefixesPowersAndDivisors) {
  const auto unit = read_unit("kN/(mm s)");
  ASSERT_TRUE(unit);
  EXPECT_EQ(unit->dimension, (Dimension{1, 0, -3}));
  EXPECT_DOUBLE_EQ(unit->si, 1e6);
  EXPECT_DOUBLE_EQ(read_unit("cm^2")->si, 1e-4);
  EXPECT_DOUBLE_EQ(read_unit("s^-1")->si, 1);
  EXPECT_EQ(read_unit("s^-1")->dimension, (Dimension{0, 0, -1}));
  EXPECT_DOUBLE_EQ(read_unit("min")->si, 60);
}

TEST(UnitSystem, WhatIsNoUnitIsNotRead) {
  for (const char* text : {"", " ", "furlong", "m^", "m^x", "m^0", "m^99999999999999999999", "m+s",
                           "cN", "kkg", "m;", "mkm"})
    EXPECT_FALSE(read_unit(text)) << text;
  EXPECT_FALSE(read_unit(std::string(1000, 'm')));
}

TEST(UnitSystem, WrongNamesAreToldByMember) {
  EXPECT_FALSE(check(kTonne) || check(kInches));
  const auto fault = check({"furlong", "kg", "", "s"});
  ASSERT_TRUE(fault);
  EXPECT_STREQ(fault->member, "length");
  EXPECT_EQ(fault->text,
            "must be a unit of length such as \"m\", \"mm\" or \"in\", got \"furlong\"");
  EXPECT_STREQ(check({"", "kg", "", "s"})->member, "length");
  EXPECT_STREQ(check({"kg", "kg", "", "s"})->member, "length");
  EXPECT_STREQ(check({"m", "", "", "s"})->member, "mass");
  EXPECT_STREQ(check({"m", "kg", "N", "s"})->member, "mass");
  EXPECT_STREQ(check({"m", "N", "", "s"})->member, "mass");
  EXPECT_STREQ(check({"m", "", "kg", "s"})->member, "force");
  EXPECT_STREQ(check({"m", "kg", "", "m"})->member, "time");
}

}  // namespace
}  // namespace mbcosim::unit_system_test
