/// Messages as bytes or JSON, and the envelopes that streams put around them.
#pragma once

#include <google/protobuf/message.h>

#include <optional>
#include <string>
#include <string_view>

namespace mbcosim::server::http {

enum class Encoding { binary, json };

/// Why `text` is no such message; empty: it is, and `message` holds it. JSON with unknown fields is
/// refused.
std::string decode(Encoding encoding, std::string_view text, google::protobuf::Message* message);
/// JSON has the names of the proto in lower camel case and every field that is no message.
std::string encode(Encoding encoding, const google::protobuf::Message& message);

/// One byte of flags, the length as 32 bits, big-endian, then that many bytes: the envelope of
/// Connect's streams and of gRPC-Web alike.
struct Envelope {
  unsigned char flags = 0;
  std::string_view payload;
};
inline constexpr std::size_t kEnvelopeBytes = 5;
inline constexpr unsigned char kCompressed = 1;
std::string wrap(unsigned char flags, std::string_view payload);
/// The first envelope of `bytes`, which it takes off; no value: there is no whole one.
std::optional<Envelope> unwrap(std::string_view* bytes);

std::string to_base64(std::string_view bytes);
/// With or without padding; no value: not base64.
std::optional<std::string> from_base64(std::string_view text);
/// A JSON string with its quotes.
std::string json_string(std::string_view text);

}  // namespace mbcosim::server::http
