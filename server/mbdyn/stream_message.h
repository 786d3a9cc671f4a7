/// The bytes of MBDyn's streams: numbers one after the other, as doubles or by a `copy cast`.
#pragma once

#include <string>
#include <vector>

#include "model/deck_channel.h"

namespace mbcosim::mbdyn {

/// Bytes of a message with `count` values.
std::size_t stream_size(const DeckChannel& channel, int count);
/// Integers are truncated towards zero; one out of the range of its type takes the nearest end.
std::string encode_stream(const DeckChannel& channel, const std::vector<double>& values);
/// Throws ChannelLost for numbers that are not finite.
std::vector<double> decode_stream(const DeckChannel& channel, int count, const std::string& bytes);

}  // namespace mbcosim::mbdyn
