#include "model/deck_channel.h"

#include <sstream>

#include "model/card.h"
#include "model/model.h"

namespace mbcosim {
namespace {

constexpr int kBytes[] = {1, 1, 2, 2, 4, 4, 4, 8};  ///< by ChannelField::Type

ChannelField::Type read_type(Card& card) {
  return static_cast<ChannelField::Type>(card.required(
      "type of a value",
      {"int8_t", "uint8_t", "int16_t", "uint16_t", "int32_t", "uint32_t", "float", "double"}));
}

int find_type(Card& card) {
  return card.one_of(
      {"int8_t", "uint8_t", "int16_t", "uint16_t", "int32_t", "uint32_t", "float", "double"});
}

constexpr int kLongestMessage = 1 << 20;  ///< [bytes]

/// Which types travel with their bytes reversed: `swap, { <types> | detect | yes | no }`.
std::vector<bool> read_swapped_types(Card& card) {
  std::vector<bool> swapped(8, false);
  if (!card.keyword("swap")) return swapped;
  if (card.one_of({"detect", "yes"}) >= 0)
    return std::vector<bool>(8, true);  // hosts are little-endian
  if (card.keyword("no")) return swapped;
  int type = find_type(card);
  if (type < 0)
    card.fail_expected("copy cast: types, `detect`, `yes` or `no` expected after `swap`");
  for (; type >= 0; type = find_type(card)) swapped[type] = true;
  return swapped;
}

void read_fields(Card& card, int count, const std::vector<bool>& swapped, DeckChannel& channel) {
  const auto make = [&](ChannelField::Type type, int skip) {
    channel.fields.push_back({type, swapped[static_cast<int>(type)], skip});
  };
  if (card.keyword("all")) {
    const ChannelField::Type type = read_type(card);
    for (int k = 0; k < count; ++k) make(type, 0);
    return;
  }
  int skip = 0;
  const auto read_skip = [&] {
    while (card.keyword("skip")) {
      const int bytes = card.integer("bytes to skip");
      if (bytes < 0 || bytes > 65536) card.fail("copy cast: from 0 to 65536 bytes can be skipped");
      skip += bytes;
      if (skip > kLongestMessage) card.fail("copy cast: a message has at most 1048576 bytes");
    }
  };
  for (int k = 0; k < count; ++k) {
    read_skip();
    make(read_type(card), skip);
    skip = 0;
  }
  read_skip();
  channel.message_bytes = skip;  // trailing; the size of the fields is added
}

}  // namespace

std::vector<const DeckChannel*> deck_channels(const Model& model) {
  std::vector<const DeckChannel*> channels;
  for (const auto& listener : model.step_listeners)
    if (const auto* channel = dynamic_cast<const DeckChannel*>(listener.get()))
      channels.push_back(channel);
  return channels;
}

std::string log_line(const DeckChannel& channel) {
  const ChannelAddress& address = channel.address;
  const bool is_output = channel.content == DeckChannel::Content::output;
  std::ostringstream s;
  s << (is_output ? "outputelement: " : "filedriver: ") << channel.label << " stream ";
  if (address.kind == ChannelAddress::Kind::local)
    s << "UNIX " << channel.port << ' ' << address.path;
  else
    s << "INET " << channel.port << ' ' << address.host << ' ' << address.port;
  s << (address.kind == ChannelAddress::Kind::udp ? " udp " : " tcp ") << address.create << ' '
    << channel.signal << ' ';
  if (is_output)
    s << channel.blocking << ' ' << channel.at_start << ' ' << channel.abort_if_broken << ' '
      << channel.every;
  else
    s << !channel.blocking << ' ' << channel.every << ' ' << channel.at_start << ' '
      << channel.timeout;
  s << ' ' << channel.log_end;
  return s.str();
}

ChannelAddress read_channel_address(Card& card, int default_port) {
  constexpr int kLargestPort = 65535;
  ChannelAddress address;
  if (card.keyword("create")) address.create = card.yes_no("create");
  if (card.keyword("grpc")) return address;
  const SourceSpan where = card.next();
  address.kind = ChannelAddress::Kind::tcp;
  address.port = default_port;
  bool given = default_port > 0;
  if (card.one_of({"local", "path"}) >= 0) {
    address.kind = ChannelAddress::Kind::local;
    address.path = card.quoted("path");
    given = true;
  } else {
    if (card.keyword("port")) {
      address.port = card.integer("port");
      if (address.port < 1 || address.port > kLargestPort)
        card.fail("a port is a number from 1 to " + std::to_string(kLargestPort) + ", got " +
                  std::to_string(address.port));
      given = true;
    }
    if (card.keyword("host")) address.host = card.quoted("host");
  }
  if (!given)
    card.fail_at(where, "the address of the socket is missing",
                 "write `path, \"...\"` or `port, <number>, host, \"...\"`");
  if (card.keyword("socket type") && card.required("socket type", {"tcp", "udp"}) == 1)
    address.kind = ChannelAddress::Kind::udp;
  return address;
}

void read_channel_modifier(Card& card, int count, DeckChannel& channel) {
  if (!card.keyword("modifier") || card.required("modifier", {"copy", "copy cast"}) == 0) return;
  const std::vector<bool> swapped = read_swapped_types(card);
  read_fields(card, count, swapped, channel);
  for (const ChannelField& field : channel.fields) {
    channel.message_bytes += field.skip + kBytes[static_cast<int>(field.type)];
    if (channel.message_bytes > kLongestMessage)
      card.fail("copy cast: a message has at most 1048576 bytes");
  }
  if (!card.keyword("size")) return;
  const int size = card.integer("size of a message");
  if (size < channel.message_bytes || size > kLongestMessage)
    card.fail("copy cast: the size must be from " + std::to_string(channel.message_bytes) +
              " to 1048576 bytes, got " + std::to_string(size));
  channel.message_bytes = size;
}

void read_channel_echo(Card& card, DeckChannel& channel) {
  if (!card.keyword("echo")) return;
  channel.echo = card.quoted("echo");
  if (card.keyword("precision")) channel.echo_precision = card.integer("precision");
  if (channel.echo_precision < 1 || channel.echo_precision > 17)
    card.fail("the precision must be from 1 to 17 digits");
  if (card.keyword("shift")) channel.echo_shift = card.real("shift");
}

}  // namespace mbcosim
