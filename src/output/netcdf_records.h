/// The records of a NetCDF file (classic format with 64-bit offsets), which stand one behind the
/// other at its end.
#pragma once

#include <cstdint>
#include <string>

#include "model/diagnostic.h"

namespace mbcosim {

/// Ends the file after so many records; nobody may have it open. ErrorKind::data_loss when it has
/// fewer within its first `size` bytes or is no such file.
Status cut_records(const std::string& path, std::int64_t count, std::int64_t size);

}  // namespace mbcosim
