/// Numbers as text against the C library.
#include "output/scientific.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdio>
#include <limits>
#include <random>
#include <string>

namespace mbcosim::scientific_test {
namespace {

std::string written(double v, int precision) {
  char text[64];
  return std::string(text, write_scientific(text, v, precision));
}

std::string general(double v, int precision) {
  char text[64];
  return std::string(text, write_general(text, v, precision));
}

void expect_as_printf(double v, int precision) {
  char text[64];
  std::snprintf(text, sizeof text, "%.*e", precision, v);
  ASSERT_EQ(written(v, precision), text) << "precision " << precision;
  std::snprintf(text, sizeof text, "%.*g", precision, v);
  ASSERT_EQ(general(v, precision), text) << "precision " << precision;
}

constexpr int kPrecisions[] = {0, 1, 2, 5, 6, 7, 12, 15, 16, 17, 20};

TEST(Scientific, WritesRandomNumbersAsPrintf) {
  std::mt19937_64 generator(7);
  std::uniform_real_distribution<double> mantissa(-10, 10);
  std::uniform_int_distribution<int> exponent(-40, 40);
  for (int k = 0; k < 20000; ++k) {
    const double v = mantissa(generator) * std::pow(10, exponent(generator));
    for (const int precision : kPrecisions) expect_as_printf(v, precision);
  }
}

TEST(Scientific, WritesAnyBitsAsPrintf) {
  std::mt19937_64 generator(8);
  for (int k = 0; k < 20000; ++k) {
    const double v = std::bit_cast<double>(generator());
    if (std::isfinite(v))
      for (const int precision : {6, 15, 16}) expect_as_printf(v, precision);
  }
}

/// Halves between two numbers of the precision: ties go to even digits.
TEST(Scientific, RoundsTiesToEven) {
  EXPECT_EQ(written(2.5, 0), "2e+00");
  EXPECT_EQ(written(3.5, 0), "4e+00");
  EXPECT_EQ(written(1000000.5, 6), "1.000000e+06");
  EXPECT_EQ(written(1000001.5, 6), "1.000002e+06");
  EXPECT_EQ(written(8388609.5, 6), "8.388610e+06");
  for (int k = -4000; k < 4000; ++k)
    for (const double unit : {.5, .125, .0625, 1. / 4096, 8., 500., 5e6})
      for (const int precision : kPrecisions) expect_as_printf(k * unit, precision);
}

/// Where the number of digits changes, on both sides.
TEST(Scientific, KeepsTheNumberOfDigitsAtPowersOfTen) {
  for (int k = -310; k <= 308; ++k) {
    const double power = std::pow(10, k);
    for (const double v : {power, std::nextafter(power, 0), std::nextafter(power, HUGE_VAL),
                           power * (1 - 5e-8), power * 9.9999995})
      for (const int precision : kPrecisions) expect_as_printf(v, precision);
  }
}

/// Numbers with zeros to leave out, fixed and with an exponent.
TEST(Scientific, WritesShortNumbersAsPrintf) {
  EXPECT_EQ(general(.001, 6), "0.001");
  EXPECT_EQ(general(1e-5, 6), "1e-05");
  EXPECT_EQ(general(120000, 6), "120000");
  EXPECT_EQ(general(999999.5, 6), "1e+06");
  for (int k = -3000; k < 3000; ++k)
    for (const double unit : {1e-7, 1e-5, 1e-3, .1, 1., 500., 1e4})
      for (const int precision : kPrecisions) expect_as_printf(k * unit, precision);
}

TEST(Scientific, WritesWhatIsNoUsualNumber) {
  using Limits = std::numeric_limits<double>;
  for (const double v : {0., -0., Limits::infinity(), -Limits::infinity(), Limits::denorm_min(),
                         Limits::min(), Limits::max(), -Limits::max()})
    for (const int precision : kPrecisions) expect_as_printf(v, precision);
  EXPECT_EQ(written(Limits::quiet_NaN(), 6), "nan");
}

}  // namespace
}  // namespace mbcosim::scientific_test
