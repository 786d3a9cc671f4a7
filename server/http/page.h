/// The page that the daemon serves: one HTML document with everything in it.
#pragma once

#include <string_view>

namespace mbcosim::server::http {

/// Empty: the daemon was built without it.
std::string_view page_document();

}  // namespace mbcosim::server::http
