#include <gtest/gtest.h>

#include "deck_fixture.h"

namespace mbcosim::decks::structured_values_test {
namespace {

Mat6 read_mat6(const std::string& text) {
  Mat6 m = Mat6::Zero();
  EXPECT_EQ(probe({}, text, [&](Card& card) { m = card.mat6("stiffness"); }), "");
  return m;
}

/// Elements 100 i + 10 j by rows.
std::string numbered_list() {
  std::string text;
  for (int i = 1; i <= 6; ++i)
    for (int j = 1; j <= 6; ++j)
      text += (text.empty() ? "" : ", ") + std::to_string(100 * i + 10 * j) + ".";
  return text;
}

void expect_product(const Mat6& m, std::initializer_list<double> force) {
  Vec6 strain;
  strain << 1e-3, 2e-3, 3e-3, 4e-3, 5e-3, 6e-3;
  const Vec6 f = m * strain;
  int i = 0;
  for (const double x : force) EXPECT_NEAR(f(i++), x, 1e-12);
}

TEST(Mat6, ReadsAllForms) {
  expect_product(read_mat6("matr, " + numbered_list()), {3.01, 5.11, 7.21, 9.31, 11.41, 13.51});
  expect_product(read_mat6(numbered_list()), {3.01, 5.11, 7.21, 9.31, 11.41, 13.51});
  expect_product(read_mat6("anba, " + numbered_list()), {7.15, 2.95, 5.05, 13.45, 9.25, 11.35});
  std::string upper;
  for (int k = 1; k <= 21; ++k) upper += ", " + std::to_string(10 * k) + ".";
  expect_product(read_mat6("sym" + upper), {.91, 1.92, 2.67, 3.18, 3.5, 3.71});
  expect_product(read_mat6("eye, scale, 1000."), {1, 2, 3, 4, 5, 6});
  expect_product(read_mat6("diag, 1.,2.,3.,4.,5.,6., scale, 2."),
                 {2e-3, 8e-3, 18e-3, 32e-3, 50e-3, 72e-3});
  EXPECT_EQ(read_mat6("null"), Mat6::Zero());
}

TEST(Mat3, SkewIsMinusTheCrossProduct) {
  EXPECT_EQ(probe({}, "skew, 1000., 2000., 5000.",
                  [](Card& card) {
                    const Vec3 f = card.mat3("stiffness") * Vec3(1e-3, 2e-3, 3e-3);
                    EXPECT_LT((f - Vec3(4, -2, 0)).norm(), 1e-12);
                  }),
            "");
}

TEST(Mat6xN, PermutesRowsForAnba) {
  EXPECT_EQ(probe({}, "anba, 1.,2., 3.,4., 5.,6., 7.,8., 9.,10., 11.,12., scale, 2., null",
                  [](Card& card) {
                    MatX expected(6, 2);
                    expected << 10, 12, 2, 4, 6, 8, 22, 24, 14, 16, 18, 20;
                    EXPECT_EQ(card.mat6xn("coefficients", 2), expected);
                    EXPECT_EQ(card.mat6xn("coefficients", 2), MatX::Zero(6, 2));
                  }),
            "");
}

TEST(Vec3, ComponentsMayBeEmptyAndScaled) {
  EXPECT_EQ(probe({}, "1.,,3., ,,, default, 1.,2.,3., scale, 2.",
                  [](Card& card) {
                    EXPECT_EQ(card.vec3("v"), Vec3(1, 0, 3));
                    EXPECT_EQ(card.vec3("v"), Vec3(0, 0, 0));
                    EXPECT_EQ(card.vec3("v"), Vec3(0, 0, 0));
                    EXPECT_EQ(card.vec3("v"), Vec3(2, 4, 6));
                  }),
            "");
}

TEST(Numbers, AreConverted) {
  EXPECT_EQ(probe({}, "1.9, TRUE, , yes, 0, NO",
                  [](Card& card) {
                    EXPECT_EQ(card.integer("count"), 1);
                    EXPECT_EQ(card.real("x"), 1);
                    EXPECT_EQ(card.real("x", 7), 7);
                    EXPECT_TRUE(card.yes_no("flag"));
                    EXPECT_FALSE(card.yes_no("flag"));
                    EXPECT_FALSE(card.yes_no("flag"));
                  }),
            "warning: user defined element 1: count 1.9 truncated to 1");
}

TEST(Words, IgnoreBlanksAndCase) {
  EXPECT_EQ(probe({}, "From  NODES, eye, (null)",
                  [](Card& card) {
                    EXPECT_TRUE(card.keyword("from nodes"));
                    EXPECT_EQ(card.one_of({"null", "eye"}), 1);
                    EXPECT_EQ(card.peek_word(), "");
                    EXPECT_EQ(card.one_of({"null", "eye"}), -1);
                    card.real("x");
                  }),
            "error: unknown variable \"null\"");
}

TEST(TemplateDrive, CombinesEntitiesAndDrives) {
  DeckText deck;
  deck.initial_value = "initial time: 2.;";
  deck.before = "template drive caller: 7, 3, single, 0.,0.,1., 5.;\n";
  EXPECT_EQ(probe(deck,
                  "null, single, 1.,2.,3., 2., 1.,2.,3., scale, 2., 3., array, 2, 1.,0.,0., 2., "
                  "0.,1.,0., 3., component, 1., "
                  "inactive, 4., reference, 7",
                  [](Card& card) {
                    const EvalContext& context = card.builder().input_context();
                    const auto next = [&] { return card.vec3_drive()->value(context); };
                    EXPECT_EQ(next(), Vec3(0, 0, 0));
                    EXPECT_EQ(next(), Vec3(2, 4, 6));
                    EXPECT_EQ(next(), Vec3(6, 12, 18));
                    EXPECT_EQ(next(), Vec3(2, 3, 0));
                    EXPECT_EQ(next(), Vec3(1, 0, 4));
                    EXPECT_EQ(next(), Vec3(0, 0, 5));
                  }),
            "");
}

}  // namespace
}  // namespace mbcosim::decks::structured_values_test
