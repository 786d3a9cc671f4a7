/// How much a folder holds.
#pragma once

#include <cstdint>
#include <string>

namespace mbcosim::server {

/// Bytes of a file; 0 when there is none.
std::int64_t bytes_of_file(const std::string& path);

/// Bytes of all files in a folder and its folders. Links count nothing: what they lead to is not in
/// the folder.
std::int64_t bytes_in(const std::string& folder);

}  // namespace mbcosim::server
