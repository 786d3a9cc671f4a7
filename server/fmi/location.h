/// Where an importer says that the resources of an FMU lie.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace mbcosim::fmi {

/// The folder that FMI 2's URI ("file:///tmp/a%20b/resources") or FMI 3's path names; nothing when
/// what follows a "%" of the URI are no two hexadecimal digits.
std::optional<std::string> folder_of(std::string_view location);
/// FMI 2's URI of a folder with an absolute path; RFC 3986, section 2.
std::string uri_of(std::string_view folder);

}  // namespace mbcosim::fmi
