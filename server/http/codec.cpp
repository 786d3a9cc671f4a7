#include "http/codec.h"

#include <google/protobuf/util/json_util.h>

#include <array>
#include <cstdint>
#include <nlohmann/json.hpp>

namespace mbcosim::server::http {
namespace {

constexpr std::string_view kAlphabet =
    "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

std::string json_of(const google::protobuf::Message& message) {
  google::protobuf::util::JsonPrintOptions options;
  options.always_print_primitive_fields = true;
  std::string text;
  const auto status = google::protobuf::util::MessageToJsonString(message, &text, options);
  if (!status.ok()) throw std::runtime_error("a reply has no JSON form");
  return text;
}

}  // namespace

std::string decode(Encoding encoding, std::string_view text, google::protobuf::Message* message) {
  if (encoding == Encoding::binary) {
    const bool read = message->ParseFromArray(text.data(), static_cast<int>(text.size()));
    return read ? "" : "the body is no " + message->GetTypeName();
  }
  const auto status = google::protobuf::util::JsonStringToMessage(
      google::protobuf::StringPiece(text.data(), text.size()), message);
  if (status.ok()) return "";
  return "the body is no " + message->GetTypeName() + ": " + status.message().ToString();
}

std::string encode(Encoding encoding, const google::protobuf::Message& message) {
  return encoding == Encoding::json ? json_of(message) : message.SerializeAsString();
}

std::string wrap(unsigned char flags, std::string_view payload) {
  const auto length = static_cast<std::uint32_t>(payload.size());
  std::string bytes(kEnvelopeBytes, '\0');
  bytes[0] = static_cast<char>(flags);
  for (int i = 0; i < 4; ++i) bytes[1 + i] = static_cast<char>(length >> (24 - 8 * i));
  return bytes.append(payload);
}

std::optional<Envelope> unwrap(std::string_view* bytes) {
  if (bytes->size() < kEnvelopeBytes) return std::nullopt;
  std::uint32_t length = 0;
  for (int i = 1; i <= 4; ++i) length = length << 8 | static_cast<unsigned char>((*bytes)[i]);
  if (bytes->size() - kEnvelopeBytes < length) return std::nullopt;
  const Envelope result{static_cast<unsigned char>(bytes->front()),
                        bytes->substr(kEnvelopeBytes, length)};
  bytes->remove_prefix(kEnvelopeBytes + length);
  return result;
}

std::string to_base64(std::string_view bytes) {
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t group = 0;
    for (std::size_t k = 0; k < 3; ++k)
      group = group << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0);
    for (std::size_t k = 0; k < 4; ++k)
      text += i + k <= bytes.size() ? kAlphabet[group >> (18 - 6 * k) & 63] : '=';
  }
  return text;
}

std::optional<std::string> from_base64(std::string_view text) {
  while (!text.empty() && text.back() == '=') text.remove_suffix(1);
  std::string bytes;
  std::uint32_t group = 0;
  int bits = 0;
  for (const char c : text) {
    const std::size_t digit = kAlphabet.find(c);
    if (digit == std::string_view::npos) return std::nullopt;
    group = group << 6 | static_cast<std::uint32_t>(digit);
    bits += 6;
    if (bits >= 8) {
      bits -= 8;
      bytes += static_cast<char>(group >> bits & 255);
    }
  }
  return bytes;
}

std::string json_string(std::string_view text) {
  return nlohmann::json(text).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace mbcosim::server::http
