#include "output/scientific.h"

#include <array>
#include <bit>
#include <charconv>
#include <cstdint>
#include <cstring>

namespace mbcosim {

namespace {

using Wide = unsigned __int128;

constexpr int kMostDigits = 17;
constexpr int kLargestExponent = 98;  ///< and one more after rounding: two digits are enough
constexpr int kLargestPower = kLargestExponent + 1 + kMostDigits;
constexpr int kLargestExactPower = 27;  ///< 5²⁷ < 2⁶⁴

/// The leading 64 bits of 10ⁿ for |n| ≤ kLargestPower: too low by less than two of the last ones,
/// exact for 0 ≤ n ≤ kLargestExactPower.
constexpr auto kPowers = [] {
  std::array<std::uint64_t, 2 * kLargestPower + 1> p{};
  constexpr Wide kLeading = Wide(1) << 127;
  Wide up = kLeading, down = kLeading;
  for (int n = 0; n <= kLargestPower; ++n) {
    p[kLargestPower + n] = static_cast<std::uint64_t>(up >> 64);
    p[kLargestPower - n] = static_cast<std::uint64_t>(down >> 64);
    up = (up >> 4) * 10;
    down /= 10;
    while (up < kLeading) up <<= 1;
    while (down < kLeading) down <<= 1;
  }
  return p;
}();
constexpr std::uint64_t power(int n) { return kPowers[kLargestPower + n]; }

constexpr auto kTens = [] {
  std::array<std::uint64_t, kMostDigits + 1> p{};
  p[0] = 1;
  for (std::size_t k = 1; k < p.size(); ++k) p[k] = 10 * p[k - 1];
  return p;
}();

/// ⌊log10 2ⁿ⌋ and ⌊log2 10ⁿ⌋ for all exponents of doubles.
int log10_of_two_to(int n) { return (n * 315653) >> 20; }
int log2_of_ten_to(int n) { return (n * 1741647) >> 19; }

/// A number of `count` digits: digits 10^(exponent + 1 − count).
struct Decimal {
  std::uint64_t digits;
  int exponent;
};

/// |v| to `count` digits, ties to even; false when that takes longer arithmetic.
bool round_decimal(double v, int count, Decimal& decimal) {
  constexpr int kMantissa = 52, kBias = 1023, kSpare = 63 - kMantissa;
  const auto bits = std::bit_cast<std::uint64_t>(v);
  // |v| = m 2^(binary − 63), m with all its 64 bits
  const int binary = static_cast<int>(bits >> kMantissa & 0x7ff) - kBias;
  const std::uint64_t m = bits << kSpare | std::uint64_t(1) << 63;
  int exponent = log10_of_two_to(binary);
  if (exponent < -kLargestExponent || exponent >= kLargestExponent) return false;
  exponent += log2_of_ten_to(exponent + 1) == binary && m >= power(exponent + 1);
  const int n = count - 1 - exponent;
  const Wide product = Wide(m) * power(n);
  const auto high = static_cast<std::uint64_t>(product >> 64);
  const int shift = 62 - binary - log2_of_ten_to(n);
  const std::uint64_t half = std::uint64_t(1) << (shift - 1), rest = high & (2 * half - 1);
  const bool exact = n >= 0 && n <= kLargestExactPower;
  if (!exact && half - rest <= 2) return false;
  const bool tie = rest == half && static_cast<std::uint64_t>(product) == 0;
  std::uint64_t digits = high >> shift;
  digits += tie ? digits % 2 : rest >= half;
  const bool longer = digits == kTens[count];
  decimal = {longer ? kTens[count - 1] : digits, exponent + longer};
  return true;
}

/// All of them at once: numbers of four, two and one digits side by side.
void write_eight_digits(char* out, std::uint64_t digits) {
  static_assert(std::endian::native == std::endian::little);
  const std::uint64_t fours = digits / 10000 | digits % 10000 << 32;
  const std::uint64_t hundreds = fours * 10486 >> 20 & 0x7f0000007f;  // 10486 / 2²⁰ ≈ 1 / 100
  const std::uint64_t twos = hundreds | (fours - 100 * hundreds) << 16;
  const std::uint64_t tens = twos * 103 >> 10 & 0xf000f000f000f;  // 103 / 2¹⁰ ≈ 1 / 10
  const std::uint64_t ones = tens | (twos - 10 * tens) << 8;
  const std::uint64_t text = ones | 0x3030303030303030;
  std::memcpy(out, &text, sizeof text);
}

/// Up to seven characters behind them are written over.
void write_long_digits(char* out, std::uint64_t digits, int count) {
  if (count > 16) {
    *out++ = static_cast<char>('0' + digits / kTens[16]);
    digits %= kTens[16];
    count = 16;
  }
  write_eight_digits(out, digits / kTens[8] * kTens[16 - count]);
  write_eight_digits(out + count - 8, digits % kTens[8]);
}

void write_digits(char* out, std::uint64_t digits, int count) {
  if (count > 8) return write_long_digits(out, digits, count);
  write_eight_digits(out, digits * kTens[8 - count]);
}

char* write_sign(char* out, double v) {
  *out = '-';
  return out + (std::bit_cast<std::uint64_t>(v) >> 63);
}

constexpr auto kExponents = [] {
  std::array<std::array<char, 4>, 2 * kLargestExponent + 3> p{};
  for (int k = 0; k <= kLargestExponent + 1; ++k)
    for (const bool negative : {true, false})
      p[kLargestExponent + 1 + (negative ? -k : k)] = {'e', negative ? '-' : '+',
                                                       static_cast<char>('0' + k / 10),
                                                       static_cast<char>('0' + k % 10)};
  return p;
}();

char* write_exponent(char* out, int exponent) {
  std::memcpy(out, &kExponents[kLargestExponent + 1 + exponent], 4);
  return out + 4;
}

}  // namespace

char* write_scientific(char* out, double v, int precision) {
  Decimal decimal{0, 0};
  if (precision < 0 || precision >= kMostDigits ||
      (v != 0 && !round_decimal(v, precision + 1, decimal)))
    return std::to_chars(out, out + precision + 9, v, std::chars_format::scientific, precision).ptr;
  out = write_sign(out, v);
  if (v == 0) {
    constexpr char kZero[] = "0.0000000000000000";
    std::memcpy(out, kZero, sizeof kZero);
  } else {
    write_digits(out + 1, decimal.digits, precision + 1);
    out[0] = out[1];
    out[1] = '.';
  }
  return write_exponent(out + 1 + precision + (precision > 0), decimal.exponent);
}

char* write_general(char* out, double v, int precision) {
  const int count = precision == 0 ? 1 : precision;
  Decimal decimal{0, 0};
  if (count < 0 || count > kMostDigits || (v != 0 && !round_decimal(v, count, decimal)))
    return std::to_chars(out, out + count + 15, v, std::chars_format::general, precision).ptr;
  const int exponent = decimal.exponent;
  char digits[kMostDigits + 7];
  write_digits(digits, decimal.digits, count);
  int used = count;
  while (used > 1 && digits[used - 1] == '0') --used;
  out = write_sign(out, v);
  const auto copy = [&](int from, int to) {
    for (int k = from; k < to; ++k) *out++ = digits[k];
  };
  const bool fixed = exponent >= -4 && exponent < count;
  if (fixed && exponent < 0) {
    *out++ = '0';
    *out++ = '.';
    for (int k = -1; k > exponent; --k) *out++ = '0';
    copy(0, used);
    return out;
  }
  const int whole = fixed ? exponent + 1 : 1;
  copy(0, whole);
  if (used > whole) *out++ = '.';
  copy(whole, used);
  return fixed ? out : write_exponent(out, exponent);
}

}  // namespace mbcosim
