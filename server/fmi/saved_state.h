/// States of an FMU as bytes.
#pragma once

#include <string>
#include <string_view>

#include "fmi/instance.h"

namespace mbcosim::fmi {

std::string to_bytes(const SavedState& saved, std::uint64_t model_digest);
/// ErrorKind::data_loss when they are damaged, ErrorKind::precondition when they belong to another
/// FMU than that of `token`.
Result<SavedState> saved_state_from_bytes(std::string_view bytes, const std::string& token,
                                          std::uint64_t model_digest);

}  // namespace mbcosim::fmi
