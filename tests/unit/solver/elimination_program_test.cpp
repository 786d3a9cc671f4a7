/// Lists of operations by level: the bits of one operation after the other.
#include "solver/elimination_program.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <random>
#include <vector>

namespace mbcosim::elimination_program_test {
namespace {

constexpr int kBlock = EliminationProgram::kBlock;

/// The same operations for a program and one after the other.
class Twice {
 public:
  /// `window`: products after which a window ends; null: there is one window.
  explicit Twice(std::vector<double> numbers, std::size_t window = 0)
      : program(numbers.size()), expected(std::move(numbers)), window_(window) {}

  void update(std::size_t target, int count, const std::vector<NumberProduct>& products,
              std::optional<std::size_t> pivot) {
    program.begin(target, count);
    for (const NumberProduct& each : products) {
      program.subtract_product(each.factor, each.other);
      for (int i = 0; i < count; ++i)
        expected[target + i] -= expected[each.factor + i] * expected[each.other];
    }
    end(products.size(), pivot);
    for (int i = 0; pivot && i < count; ++i) expected[target + i] /= expected[*pivot];
  }

  void subtract_dots(std::size_t target, const std::vector<NumberProduct>& blocks,
                     std::optional<std::size_t> pivot) {
    program.begin(target, 1);
    for (const NumberProduct& each : blocks) {
      program.subtract_dot(each.factor, each.other);
      for (int i = kBlock; i-- > 0;)
        expected[target] -= expected[each.factor + i] * expected[each.other + i];
    }
    end(blocks.size(), pivot);
    if (pivot) expected[target] /= expected[*pivot];
  }

  EliminationProgram program;
  std::vector<double> expected;

 private:
  void end(std::size_t products, std::optional<std::size_t> pivot) {
    program.end(pivot);
    products_ += products;
    if (window_ == 0 || products_ < window_) return;
    program.end_window();
    products_ = 0;
  }

  std::size_t window_, products_ = 0;
};

/// Any operations on a few numbers, so that nearly all depend on each other, in windows of one to
/// seven products. A target is not among what it gets.
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
    Twice twice(begin, 1 + seed % 7);
    for (std::size_t k = 0; k < size; ++k)
      twice.program.set(k, static_cast<int>(k), static_cast<int>(k));
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
      if (alone && below(2) == 0) {
        for (NumberProduct& each : products) {
          each.factor -= each.factor % kBlock;
          each.other -= each.other % kBlock;
        }
        twice.subtract_dots(static_cast<std::size_t>(of * kBlock + below(kBlock)), products, pivot);
        continue;
      }
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
      EXPECT_TRUE(twice.program.run(*version, values.data(), scales.data(), found.data()));
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
  EXPECT_EQ(bytes(2 * kBlock) - bytes(kBlock), 2 * (sizeof(NumberUpdate) + sizeof(NumberProduct)));
}

/// A row of cells of eight numbers, in windows of two cells: the first half of each cell begins
/// with values, of which the first one is divided by the last one of the cell before. Few of them,
/// and so many that what is ahead is fetched.
TEST(EliminationProgram, WindowsThatRepeatShareAList) {
  constexpr std::size_t kCell = 2 * kBlock;
  for (const std::size_t cells : {6, 300'000}) {
    const auto program_of = [&](std::size_t different) {
      EliminationProgram program(cells * kCell);
      for (std::size_t c = 0; c < cells; ++c) {
        if (c % 2 == 0) program.end_window();
        const std::size_t at = c * kCell, before = at < kCell ? at : at - kCell;
        program.clear(at + 1, kCell - 1);
        program.set(at, static_cast<int>(c), static_cast<int>(2 * c));
        program.require(at);
        program.begin(at + kBlock, kBlock);
        program.subtract_product(at, c == different ? at + 1 : before);
        program.end(at);
      }
      program.finish();
      return program;
    };
    const EliminationProgram program = program_of(cells);
    std::vector<double> values(cells), scales(2 * cells), numbers(cells * kCell, 7.0);
    for (std::size_t c = 0; c < cells; ++c) values[c] = 1.0 + static_cast<double>(c % 97);
    for (std::size_t c = 0; c < cells; ++c) scales[2 * c] = 2.0 + static_cast<double>(c % 89);
    const auto sizes =
        program.run(*panel_versions().back(), values.data(), scales.data(), numbers.data());
    ASSERT_TRUE(sizes);
    double largest = 0;
    for (std::size_t c = 0; c < cells; ++c) {
      const auto own = [&](std::size_t of) { return values[of] * scales[2 * of]; };
      largest = std::max(largest, own(c));
      ASSERT_EQ(numbers[c * kCell], own(c)) << c;
      ASSERT_EQ(numbers[c * kCell + 1], 0) << c;
      ASSERT_EQ(numbers[c * kCell + kBlock], -own(c == 0 ? 0 : c - 1)) << c;
      ASSERT_EQ(numbers[c * kCell + kBlock + 1], 0) << c;
    }
    EXPECT_EQ(sizes->smallest, 2);
    EXPECT_EQ(sizes->largest, largest);
    EXPECT_LT(program.bytes(), program_of(3).bytes());
    EXPECT_LT(program.bytes(), 1000 + 16 * cells) << "24 and more for each cell";
  }
}

TEST(EliminationProgram, OfNothingDoesNothing) {
  EliminationProgram program(2);
  program.begin(0, 1);
  program.end();
  program.finish();
  std::vector<double> numbers{3, 4};
  EXPECT_TRUE(program.run(*panel_versions().back(), nullptr, nullptr, numbers.data()));
  EXPECT_EQ(numbers, (std::vector<double>{3, 4}));
}

/// Numbers 0 to 3 become 0, 10, 0, 0 minus 2 times 4 to 7: in each run, whatever the last one left,
/// and also where the next window has already begun.
TEST(EliminationProgram, ClearsWhatItBeginsWith) {
  EliminationProgram program(12);
  for (const std::size_t block : {0, 8}) {
    program.end_window();  // before the first one there is nothing
    program.clear(block, 1);
    program.clear(block + 1, 3);  // both are cleared together
    program.set(block + 1, 0, 0);
    program.begin(block, kBlock);
    program.subtract_product(4, 6);
    program.end();
  }
  program.finish();
  std::vector<double> numbers{9, 9, 9, 9, 1, 3, 2, 0, 9, 9, 9, 9};
  for (const double value : {5.0, 7.0}) {
    const double scale = 2;
    ASSERT_TRUE(program.run(*panel_versions().back(), &value, &scale, numbers.data()));
    EXPECT_EQ(numbers, (std::vector<double>{-2, 2 * value - 6, -4, 0, 1, 3, 2, 0, -2, 2 * value - 6,
                                            -4, 0}));
  }
}

/// Of the numbers that are required the first becomes the value, the second one minus it.
TEST(EliminationProgram, StopsAtWhatIsNotAsRequired) {
  EliminationProgram program(8);
  program.set(0, 0, 0);
  program.require(0);
  program.set(4, 1, 0);
  program.begin(4, 1);
  program.subtract_product(0, 1);
  program.end();
  program.require(4);
  program.end_window();
  program.begin(5, 1);
  program.subtract_product(4, 1);
  program.end();
  program.finish();
  const auto runs = [&](double first, double one) {
    std::vector<double> numbers(8, 0.0);
    numbers[1] = 1;
    const std::vector<double> values{first, one};
    const double scale = 1;
    const auto sizes = program.run(*panel_versions().back(), values.data(), &scale, numbers.data());
    const bool fine = sizes.has_value();
    if (fine) {
      EXPECT_EQ(sizes->smallest, std::min(std::abs(first), std::abs(one - first)));
      EXPECT_EQ(sizes->largest, std::max(std::abs(first), std::abs(one - first)));
    }
    EXPECT_EQ(numbers[5], fine ? first - one : 0.0);
    return fine;
  };
  EXPECT_TRUE(runs(-.25, 1));
  EXPECT_TRUE(runs(.75, 1));
  EXPECT_FALSE(runs(0, 1));
  EXPECT_FALSE(runs(1, 1));
  EXPECT_FALSE(runs(HUGE_VAL, 1));
  EXPECT_FALSE(runs(.5, NAN));
}

}  // namespace
}  // namespace mbcosim::elimination_program_test
