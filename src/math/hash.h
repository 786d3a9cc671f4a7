/// FNV-1a of 64 bits and its relative for long texts. Not cryptographic.
#pragma once

#include <cstdint>
#include <cstdio>
#include <cstring>
#include <string>
#include <string_view>

namespace mbcosim {

inline constexpr std::uint64_t kFnvBasis = 0xcbf29ce484222325ull, kFnvPrime = 0x100000001b3ull;

/// By bytes; `seed`: the value of what goes before.
constexpr std::uint64_t fnv1a(std::string_view bytes, std::uint64_t seed = kFnvBasis) {
  std::uint64_t h = seed;
  for (const char c : bytes) h = (h ^ static_cast<unsigned char>(c)) * kFnvPrime;
  return h;
}

/// Fingerprint of the text a model was made of: by words of eight bytes, with a shift that carries
/// high bits down.
class Digest {
 public:
  void add(std::string_view text) {
    number(text.size());
    std::size_t i = 0;
    for (; i + 8 <= text.size(); i += 8) {
      std::uint64_t word;
      std::memcpy(&word, text.data() + i, 8);
      number(word);
    }
    for (; i < text.size(); ++i) number(static_cast<unsigned char>(text[i]));
  }
  std::uint64_t value() const { return hash_; }

 private:
  void number(std::uint64_t word) {
    hash_ = (hash_ ^ word) * kFnvPrime;
    hash_ ^= hash_ >> 29;
  }
  std::uint64_t hash_ = kFnvBasis;
};

/// A digest as clients and messages show it: 16 hexadecimal digits.
inline std::string digest_text(std::uint64_t digest) {
  char text[17];
  std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(digest));
  return text;
}

}  // namespace mbcosim
