/// States of an FMU as bytes.
#pragma once

#include <functional>
#include <string>
#include <string_view>

#include "fmi/instance.h"

namespace mbcosim::fmi {

std::string to_bytes(const SavedState& saved, std::uint64_t model_digest);
/// ErrorKind::data_loss when they are damaged, ErrorKind::precondition when they belong to another
/// FMU than that of `token`. `digest_of`: of the model with these values of symbols.
using DigestOf = std::function<Result<std::uint64_t>(const SymbolValues&)>;
Result<SavedState> saved_state_from_bytes(std::string_view bytes, const std::string& token,
                                          const DigestOf& digest_of);

}  // namespace mbcosim::fmi
