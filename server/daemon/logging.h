/// Structured logs on standard error.
#pragma once

#include "service/config.h"

namespace mbcosim::server {

void start_logging(const Config& config);

}  // namespace mbcosim::server
