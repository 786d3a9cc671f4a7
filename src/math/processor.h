/// What this machine's processor can do.
#pragma once

namespace mbcosim {

/// Level of the x86-64 architecture (x86-64 psABI, section 3.1.1): 1, 3 or 4, told by what tells
/// the levels apart on the processors that there are; 1 on other architectures.
int processor_level();

}  // namespace mbcosim
