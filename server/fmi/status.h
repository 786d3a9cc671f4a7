/// What functions of FMI 2 and FMI 3 return; the numbers are those of both standards.
#pragma once

namespace mbcosim::fmi {

enum class Status { ok, warning, discard, error, fatal };

/// Which standard an instance speaks.
enum class Standard { fmi2, fmi3 };

}  // namespace mbcosim::fmi
