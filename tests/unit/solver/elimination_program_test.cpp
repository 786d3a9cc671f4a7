/// Lists of operations by level: the bits of one operation after the other.
#include "solver/elimination_program.h"

#include <gtest/gtest.h>

#include <optional>
#include <random>
#include <vector>

namespace mbcosim::elimination_program_test {
namespace {

constexpr int kBlock = EliminationProgram::kBlock;

/// The same operations for a program and one after the other.
class Twice {
 public:
  explicit Twice(std::vector<double> numbers)
      : program(numbers.size()), expected(std::move(numbers)) {}

  void update(std::size_t target, int count, const std::vector<NumberProduct>& products,
              std::optional<std::size_t> pivot) {
    program.begin(target, count);
    for (const NumberProduct& each : products) {
      program.subtract_product(each.factor, each.other);
      for (int i = 0; i < count; ++i)
        expected[target + i] -= expected[each.factor + i] * expected[each.other];
    }
    program.end(pivot);
    for (int i = 0; pivot && i < count; ++i) expected[target + i] /= expected[*pivot];
  }

  EliminationProgram program;
  std::vector<double> expected;
};

/// Any operations on a few numbers, so that nearly all depend on each other. A target is not among
/// what it gets.
TEST(EliminationProgram, GivesTheBitsOfOneOperationAfterTheOther) {
  for (unsigned seed = 1; seed <= 200; ++seed) {
    std::mt19937 generator(seed);
    const int blocks = 3 + static_cast<int>(seed % 6);
    const auto size = static_cast<std::size_t>(blocks * kBlock);
    const auto below = [&](int n) {
      return std::uniform_int_distribution<int>(0, n - 1)(generator);
    };
    const auto number = [&] { return std::uniform_real_distribution<double>(.5, 2)(generator); };
    std::vector<double> values(size), begin(size);
    std::vector<double> scales(size);
    for (std::size_t k = 0; k < size; ++k) {
      values[k] = number();
      scales[k] = number();
      begin[k] = values[k] * scales[k];
    }
    Twice twice(begin);
    for (std::size_t k = 0; k < size; ++k) twice.program.set(k, static_cast<int>(k), scales[k]);
    for (int k = 0; k < 12; ++k) {  // more would leave the range of numbers
      // neighbours that get the same from neighbours, singly, or a number alone
      const int of = below(blocks), run = below(3) == 0 ? 1 + below(3) : 1;
      const auto other_block = [&] { return (of + 1 + below(blocks - 1)) % blocks; };
      const bool alone = below(3) == 0;
      std::vector<NumberProduct> products(below(4));
      for (NumberProduct& each : products) {
        each.factor =
            static_cast<std::uint32_t>(other_block() * kBlock + (alone ? below(kBlock) : 0));
        each.other = static_cast<std::uint32_t>(other_block() * kBlock + below(kBlock));
      }
      std::optional<std::size_t> pivot;
      if (below(3) == 0) pivot = other_block() * kBlock + below(kBlock);
      if (alone) {
        twice.update(static_cast<std::size_t>(of * kBlock + below(kBlock)), 1, products, pivot);
        continue;
      }
      const auto is_input = [&](int block) {
        const auto within = [&](std::size_t at) { return static_cast<int>(at) / kBlock == block; };
        bool found = pivot && within(*pivot);
        for (const NumberProduct& each : products)
          for (int b = 0; b < run; ++b)
            found = found || within(each.factor + b * kBlock) || within(each.other);
        return found;
      };
      for (int b = 0; b < run && of + b < blocks; ++b) {
        std::vector<NumberProduct> shifted = products;
        bool inside = true;
        for (NumberProduct& each : shifted) {
          each.factor += static_cast<std::uint32_t>(b * kBlock);
          inside = inside && each.factor + kBlock <= size;
        }
        if (inside && !is_input(of + b))
          twice.update(static_cast<std::size_t>((of + b) * kBlock), kBlock, shifted, pivot);
      }
    }
    twice.program.finish();
    for (const PanelVersion* version : panel_versions()) {
      std::vector<double> found(size, 0.0);
      twice.program.run(*version, values.data(), found.data());
      EXPECT_EQ(found, twice.expected) << version->processor << ", " << seed;
    }
  }
}

/// Of four blocks side by side three are one update, as more would not stay in registers: two
/// updates instead of four.
TEST(EliminationProgram, TakesNeighboursTogether) {
  const auto bytes = [](int apart) {
    Twice twice(std::vector<double>(64, 1.0));
    for (int b = 0; b < 4; ++b)
      twice.update(static_cast<std::size_t>(b * apart), kBlock,
                   {{static_cast<std::uint32_t>(32 + b * apart), 60}}, {});
    twice.program.finish();
    return twice.program.bytes();
  };
  EXPECT_EQ(bytes(2 * kBlock), 2 * bytes(kBlock));
}

TEST(EliminationProgram, OfNothingDoesNothing) {
  EliminationProgram program(2);
  program.begin(0, 1);
  program.end();
  program.finish();
  EXPECT_EQ(program.bytes(), 0u);
  std::vector<double> numbers{3, 4};
  program.run(*panel_versions().back(), nullptr, numbers.data());
  EXPECT_EQ(numbers, (std::vector<double>{3, 4}));
}

}  // namespace
}  // namespace mbcosim::elimination_program_test
