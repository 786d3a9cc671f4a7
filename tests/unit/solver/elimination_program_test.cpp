/// Lists of operations by level: the bits of one operation after the other.
#include "solver/elimination_program.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

namespace mbcosim::elimination_program_test {
namespace {

/// Any operations on a few numbers, so that nearly all depend on each other.
TEST(EliminationProgram, GivesTheBitsOfOneOperationAfterTheOther) {
  for (unsigned seed = 1; seed <= 200; ++seed) {
    std::mt19937 generator(seed);
    const std::size_t size = 3 + seed % 20;
    const auto any = [&] {
      return std::uniform_int_distribution<std::size_t>(0, size - 1)(generator);
    };
    const auto number = [&] { return std::uniform_real_distribution<double>(.5, 2)(generator); };
    std::vector<double> values(size), expected(size), found(size, 0.0);
    EliminationProgram program(size);
    for (std::size_t k = 0; k < size; ++k) {
      const double scale = number();
      values[k] = number();
      expected[k] = values[k] * scale;
      program.set(k, static_cast<int>(k), scale);
    }
    for (int k = 0; k < 40; ++k) {
      const std::size_t target = any(), other = any(), factor = any();
      const std::size_t count =
          1 + generator() % std::min<std::size_t>(5, size - std::max(target, factor));
      const auto within = [count](std::size_t at, std::size_t first) {
        return first <= at && at < first + count;
      };
      if (within(other, target) || within(factor, target) || within(target, factor)) continue;
      const bool divides = generator() % 3 == 0;
      for (std::size_t i = 0; i < count; ++i)
        if (divides)
          expected[target + i] /= expected[other];
        else
          expected[target + i] -= expected[factor + i] * expected[other];
      if (divides)
        program.divide(target, count, other);
      else
        program.subtract_products(target, factor, count, other);
    }
    program.finish();
    program.run(values.data(), found.data());
    EXPECT_EQ(found, expected) << seed;
  }
}

TEST(EliminationProgram, OfNothingDoesNothing) {
  EliminationProgram program(2);
  program.finish();
  std::vector<double> numbers{3, 4};
  program.run(nullptr, numbers.data());
  EXPECT_EQ(numbers, (std::vector<double>{3, 4}));
}

}  // namespace
}  // namespace mbcosim::elimination_program_test
