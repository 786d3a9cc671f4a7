/// A State as bytes: versioned, with the model's digest and a checksum.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "model/diagnostic.h"
#include "model/state.h"

namespace mbcosim {

std::string state_to_bytes(const State& state, std::uint64_t model_digest);
/// ErrorKind::data_loss when the bytes are damaged or cut, ErrorKind::precondition for another
/// model (both digests are named) or an unknown version.
Result<State> state_from_bytes(std::string_view bytes, std::uint64_t model_digest);

}  // namespace mbcosim
