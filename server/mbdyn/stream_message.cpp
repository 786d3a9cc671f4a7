#include "mbdyn/stream_message.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <type_traits>

#include "mbdyn/link.h"

namespace mbcosim::mbdyn {
namespace {

using Type = ChannelField::Type;

/// work(T{}) with the type of a field.
template <class Work>
auto with_type(Type type, Work&& work) {
  switch (type) {
    case Type::int8:
      return work(std::int8_t{});
    case Type::uint8:
      return work(std::uint8_t{});
    case Type::int16:
      return work(std::int16_t{});
    case Type::uint16:
      return work(std::uint16_t{});
    case Type::int32:
      return work(std::int32_t{});
    case Type::uint32:
      return work(std::uint32_t{});
    case Type::float32:
      return work(float{});
    default:
      return work(double{});
  }
}

template <class T>
T converted(double value) {
  if constexpr (std::is_floating_point_v<T>) return static_cast<T>(value);
  using Range = std::numeric_limits<T>;
  if (std::isnan(value)) return 0;
  return static_cast<T>(std::clamp(std::trunc(value), static_cast<double>(Range::lowest()),
                                   static_cast<double>(Range::max())));
}

void put(const ChannelField& field, double value, std::string& out) {
  out.append(static_cast<std::size_t>(field.skip), '\0');
  with_type(field.type, [&](auto zero) {
    const auto number = converted<decltype(zero)>(value);
    char bytes[sizeof number];
    std::memcpy(bytes, &number, sizeof number);
    if (field.swapped) std::reverse(bytes, bytes + sizeof number);
    out.append(bytes, sizeof number);
  });
}

double take(const ChannelField& field, const std::string& message, std::size_t& at) {
  at += static_cast<std::size_t>(field.skip);
  return with_type(field.type, [&](auto number) {
    char bytes[sizeof number];
    std::memcpy(bytes, message.data() + at, sizeof number);
    at += sizeof number;
    if (field.swapped) std::reverse(bytes, bytes + sizeof number);
    std::memcpy(&number, bytes, sizeof number);
    return static_cast<double>(number);
  });
}

}  // namespace

std::size_t stream_size(const DeckChannel& channel, int count) {
  return channel.fields.empty() ? count * sizeof(double)
                                : static_cast<std::size_t>(channel.message_bytes);
}

std::string encode_stream(const DeckChannel& channel, const std::vector<double>& values) {
  std::string out;
  for (std::size_t k = 0; k < values.size(); ++k)
    put(channel.fields.empty() ? ChannelField() : channel.fields[k], values[k], out);
  out.resize(stream_size(channel, static_cast<int>(values.size())), '\0');
  return out;
}

std::vector<double> decode_stream(const DeckChannel& channel, int count, const std::string& bytes) {
  std::vector<double> values;
  std::size_t at = 0;
  for (int k = 0; k < count; ++k) {
    values.push_back(take(channel.fields.empty() ? ChannelField() : channel.fields[k], bytes, at));
    if (!std::isfinite(values.back()))
      throw ChannelLost("value " + std::to_string(k + 1) + " is not finite");
  }
  return values;
}

}  // namespace mbcosim::mbdyn
