#include "output/scientific.h"

#include <array>
#include <bit>
#include <charconv>
#include <cstdint>
#include <cstring>
#include <optional>

namespace mbcosim {

namespace {

using Wide = unsigned __int128;

constexpr int kLargestPower = 32;  ///< 5³² · 2⁵³ < 2¹²⁸
constexpr int kMostDigits = 17;

constexpr auto kFives = [] {
  std::array<Wide, kLargestPower + 1> p{};
  p[0] = 1;
  for (int k = 1; k <= kLargestPower; ++k) p[k] = 5 * p[k - 1];
  return p;
}();
constexpr auto kTens = [] {
  std::array<std::uint64_t, kMostDigits + 2> p{};
  p[0] = 1;
  for (std::size_t k = 1; k < p.size(); ++k) p[k] = 10 * p[k - 1];
  return p;
}();
constexpr auto kPairs = [] {
  std::array<char, 200> p{};
  for (int k = 0; k < 100; ++k) {
    p[2 * k] = static_cast<char>('0' + k / 10);
    p[2 * k + 1] = static_cast<char>('0' + k % 10);
  }
  return p;
}();

/// m 2^e 10^n as a whole part and whether the rest is nothing, below, at or above one half.
struct Scaled {
  std::uint64_t whole;
  int rest;  ///< −1 below (nothing included), 0 a half, 1 above
};

int compare(Wide a, Wide b) { return a < b ? -1 : a > b ? 1 : 0; }

/// Without a value when the numbers involved are too long.
std::optional<Scaled> scale(std::uint64_t m, int e, int n) {
  if (n >= 0) {
    if (n > kLargestPower) return std::nullopt;
    const Wide product = m * kFives[n];
    const int shift = -(e + n);
    if (shift <= 0 || shift >= 128) return std::nullopt;
    const Wide whole = product >> shift, half = Wide(1) << (shift - 1);
    if (whole >> 63) return std::nullopt;
    return Scaled{static_cast<std::uint64_t>(whole), compare(product - (whole << shift), half)};
  }
  if (-n > kMostDigits || e > 10 || e < -63) return std::nullopt;
  const Wide number = e > 0 ? Wide(m) << e : m;
  const Wide divisor = e < 0 ? Wide(kTens[-n]) << -e : kTens[-n];
  const Wide whole = number / divisor;
  return Scaled{static_cast<std::uint64_t>(whole),
                compare(2 * (number - whole * divisor), divisor)};
}

// The digits after the first from the last one on, two at a time.
char* write_digits(char* out, std::uint64_t digits, int precision) {
  int k = precision;
  for (; k >= 2; k -= 2, digits /= 100) std::memcpy(out + k, &kPairs[2 * (digits % 100)], 2);
  if (k == 1) {
    out[2] = static_cast<char>('0' + digits % 10);
    digits /= 10;
  }
  out[0] = static_cast<char>('0' + digits);
  if (precision == 0) return out + 1;
  out[1] = '.';
  return out + 2 + precision;
}

char* write_exponent(char* out, int exponent) {
  *out++ = 'e';
  *out++ = exponent < 0 ? '-' : '+';
  std::memcpy(out, &kPairs[2 * (exponent < 0 ? -exponent : exponent)], 2);
  return out + 2;
}

}  // namespace

char* write_scientific(char* out, double v, int precision) {
  const auto other = [&] {
    return std::to_chars(out, out + precision + 9, v, std::chars_format::scientific, precision).ptr;
  };
  constexpr int kMantissa = 52, kBias = 1075, kSpecial = 0x7ff;
  const auto bits = std::bit_cast<std::uint64_t>(v);
  const int biased = static_cast<int>(bits >> kMantissa) & kSpecial;
  if (precision < 0 || precision >= kMostDigits || biased == kSpecial) return other();
  std::uint64_t m = bits & ((std::uint64_t(1) << kMantissa) - 1);
  const bool negative = bits >> 63;
  if (biased == 0) {
    if (m != 0) return other();
    if (negative) *out++ = '-';
    return write_exponent(write_digits(out, 0, precision), 0);
  }
  m |= std::uint64_t(1) << kMantissa;
  const int e = biased - kBias;
  // ⌊log10 2^(e + 52)⌋: the decimal exponent is this or the next
  int exponent = ((e + kMantissa) * 315653) >> 20;
  std::optional<Scaled> scaled = scale(m, e, precision - exponent);
  if (scaled && scaled->whole >= kTens[precision + 1]) scaled = scale(m, e, precision - ++exponent);
  if (!scaled || exponent <= -100 || exponent >= 99) return other();
  std::uint64_t digits = scaled->whole;
  if (scaled->rest > 0 || (scaled->rest == 0 && digits % 2 == 1)) ++digits;
  if (digits == kTens[precision + 1]) {
    digits = kTens[precision];
    ++exponent;
  }
  if (negative) *out++ = '-';
  return write_exponent(write_digits(out, digits, precision), exponent);
}

}  // namespace mbcosim
