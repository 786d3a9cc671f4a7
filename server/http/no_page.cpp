#include "http/page.h"

namespace mbcosim::server::http {

std::string_view page_document() { return {}; }

}  // namespace mbcosim::server::http
