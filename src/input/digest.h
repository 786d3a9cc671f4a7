/// Fingerprint of the text a model was made of.
#pragma once

#include <cstdint>
#include <cstring>
#include <string_view>

namespace mbcosim {

/// FNV-1a over words of eight bytes with a shift that carries high bits down; 64 bits, not
/// cryptographic.
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
    hash_ = (hash_ ^ word) * 0x100000001b3ull;
    hash_ ^= hash_ >> 29;
  }
  std::uint64_t hash_ = 0xcbf29ce484222325ull;
};

}  // namespace mbcosim
